"""Spack package. From the root of the source tree, in a Spack environment with DOLFINx:

spack repo add packaging/spack
spack dev-build py-raymortar@0.1.0
"""

from spack.package import PythonPackage, depends_on, license, version


class PyRaymortar(PythonPackage):
    """Frictional contact in large deformation for FEniCSx, by the ray-cast mortar
    method."""

    license("MIT")

    version("0.1.0")

    depends_on("cxx", type="build")
    depends_on("cmake@3.20:", type="build")
    depends_on("ninja", type="build")
    depends_on("pkgconfig", type="build")
    depends_on("py-scikit-build-core@0.8:", type="build")
    depends_on("py-pybind11@2.10:", type="build")
    depends_on("python@3.10:", type=("build", "link", "run"))
    depends_on("eigen@3.4:", type=("build", "link"))
    depends_on("mpi", type=("build", "link", "run"))
    # Real numbers, in double precision
    depends_on("petsc@3.18:~complex+mpi+mumps precision=double")
    depends_on("py-petsc4py@3.18:", type=("build", "run"))
    depends_on("py-mpi4py@3.1:", type=("build", "run"))
    depends_on("py-numpy@1.24:", type=("build", "run"))
    depends_on("py-scipy@1.8:", type=("build", "run"))
    depends_on("py-fenics-dolfinx@0.9:", type=("build", "run"))
