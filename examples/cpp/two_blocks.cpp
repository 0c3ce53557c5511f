// raymortar without Python: arrays, MPI and PETSc.
//
// A block under pressure stands on another; their meshes do not match. The
// first rank has the lower block, the last rank the upper one: neither knows
// a node of the other's. The pressure between them must be uniform.
#include "volume.h"
#include <cmath>
#include <petscksp.h>
#include <raymortar/fem/assembly.h>
#include <raymortar/fem/pattern.h>

namespace rm = raymortar;

namespace
{
constexpr double E = 2000.0, nu = 0.3, pressure = 25.0; // MPa
const ElasticBlock lower_block{{0, 0}, {1, 1}, {7, 6}, {E, nu}};
const ElasticBlock upper_block{{0, 1}, {1, 1}, {5, 4}, {E, nu}};

void check(PetscErrorCode code) { CHKERRABORT(PETSC_COMM_WORLD, code); }

/// The system is [lower u | upper u | multiplier]; what this rank has of it
struct Part
{
  bool has_lower, has_upper;
  int lower = 2 * lower_block.num_nodes();
  int upper = 2 * upper_block.num_nodes();
  int multipliers = upper_block.cells[0] + 1;

  explicit Part(MPI_Comm comm)
  {
    int rank = 0, size = 1;
    MPI_Comm_rank(comm, &rank);
    MPI_Comm_size(comm, &size);
    has_lower = rank == 0;
    has_upper = rank == size - 1;
  }
  [[nodiscard]] int begin() const { return has_lower ? 0 : lower; }
  [[nodiscard]] int bodies() const
  {
    return (has_lower ? lower : 0) + (has_upper ? upper : 0);
  }
  [[nodiscard]] int rows() const
  {
    return bodies() + (has_upper ? multipliers : 0);
  }
};

/// Nodes in a row as a contact surface
rm::Surface surface(const ElasticBlock& block, const std::vector<int>& nodes,
                    int first_row)
{
  rm::Surface s; // by default of intervals of degree 1 in the plane
  for (const int node : nodes)
  {
    const auto x = block.position(node);
    s.X.insert(s.X.end(), x.begin(), x.end());
    s.rows.insert(s.rows.end(),
                  {first_row + 2 * node, first_row + 2 * node + 1});
  }
  for (rm::Index k = 0; k + 1 < static_cast<rm::Index>(nodes.size()); ++k)
  {
    s.facet_nodes.insert(s.facet_nodes.end(), {k, k + 1});
    s.facet_id.push_back(k);
  }
  s.facet_dofs = s.facet_nodes;
  return s;
}

/// Frictionless contact of the upper block's bottom with the lower's top
rm::Zone make_zone(MPI_Comm comm, const Part& part)
{
  rm::ZoneInput in;
  if (part.has_upper)
    in.slave = surface(upper_block, upper_block.bottom(), part.lower);
  if (part.has_lower)
    in.master = surface(lower_block, lower_block.top(), 0);
  for (rm::Index k = 0; k < in.master.num_dofs(); ++k)
    in.master_node_ids.push_back(k);
  in.master_dof_ids = in.master_node_ids;
  in.multipliers.degree = in.multipliers.components = 1;
  in.multipliers.facet = in.slave.facet_dofs;
  for (rm::Index k = 0; k < in.slave.num_dofs(); ++k)
    in.multipliers.row.push_back(part.lower + part.upper + k);
  in.multipliers.value.assign(in.multipliers.row.size(), 0.0);
  in.distances = {0.3, 0.3, 0.1}; // mm: reach, depth, skin
  const double gauss = std::sqrt(1.0 / 12);
  in.segment_rules.simplex.points = {{0.5 - gauss, 0}, {0.5 + gauss, 0}};
  in.segment_rules.simplex.weights = {0.5, 0.5};
  in.facet_rule = in.segment_rules.simplex;
  return {comm, std::move(in)};
}

/// The floor is smooth; each block is kept from sliding at one corner. What
/// else the upper block needs to stand it finds in contact.
Volume make_volume(const Part& part)
{
  Volume volume(part.begin(), part.bodies());
  if (part.has_lower)
  {
    volume.add(lower_block, 0);
    for (const int node : lower_block.bottom())
      volume.hold(2 * node + 1);
    volume.hold(0);
  }
  if (part.has_upper)
  {
    volume.add(upper_block, part.lower);
    const std::vector<int> top = upper_block.top();
    volume.hold(part.lower + 2 * top.back());
    const double share = pressure * upper_block.size[0] / upper_block.cells[0];
    for (std::size_t k = 0; k < top.size(); ++k)
    {
      const bool corner = k == 0 or k + 1 == top.size();
      volume.load(part.lower + 2 * top[k] + 1, -(corner ? 0.5 : 1.0) * share);
    }
  }
  return volume;
}

/// Values of some nodes out of the rank's part of the solution
std::vector<double> at_nodes(std::span<const double> x,
                             const std::vector<int>& nodes, int begin)
{
  std::vector<double> values;
  for (const int node : nodes)
    for (int i = 0; i < 2; ++i)
      values.push_back(x[static_cast<std::size_t>(begin + 2 * node + i)]);
  return values;
}

/// The present unknowns into the zone, and its surfaces paired there
void update(rm::Zone& zone, const Part& part, std::span<const double> x,
            double scale)
{
  std::vector<double> slave, master, multiplier;
  if (part.has_lower)
    master = at_nodes(x, lower_block.top(), 0);
  if (part.has_upper)
  {
    slave = at_nodes(x, upper_block.bottom(), part.lower - part.begin());
    for (const double unknown :
         x.last(static_cast<std::size_t>(part.multipliers)))
      multiplier.push_back(scale * unknown);
  }
  zone.set_displacement(slave, master);
  zone.set_multiplier(multiplier);
  zone.pair();
}

/// A direct solver whose matrix has room for the pairs that were found
struct LinearSystem
{
  Mat A = nullptr;
  KSP ksp = nullptr;
  Vec b = nullptr, step = nullptr;
  std::vector<std::int32_t> offsets, columns; ///< of the volume
  rm::Pattern pattern;
  rm::BlockPositions positions; ///< of contact's blocks in A
  rm::AssemblyStatistics statistics;

  LinearSystem(MPI_Comm comm, const Volume& volume, Vec x)
  {
    PC pc = nullptr;
    PetscInt rows = 0;
    volume.pattern(offsets, columns);
    check(VecGetLocalSize(x, &rows));
    check(VecDuplicate(x, &b));
    check(VecDuplicate(x, &step));
    check(MatCreate(comm, &A));
    check(MatSetSizes(A, rows, rows, PETSC_DETERMINE, PETSC_DETERMINE));
    check(MatSetType(A, MATAIJ));
    check(KSPCreate(comm, &ksp));
    check(KSPSetType(ksp, KSPPREONLY));
    check(KSPGetPC(ksp, &pc));
    check(PCSetType(pc, PCLU));
    check(PCFactorSetMatSolverType(pc, MATSOLVERMUMPS));
  }
  LinearSystem(const LinearSystem&) = delete;
  LinearSystem& operator=(const LinearSystem&) = delete;
  ~LinearSystem()
  {
    KSPDestroy(&ksp);
    MatDestroy(&A);
    VecDestroy(&step);
    VecDestroy(&b);
  }

  void make_room(MPI_Comm comm, const rm::Zone& zone)
  {
    const int mine = pattern.covers(zone) ? 0 : 1;
    int any = 0;
    MPI_Allreduce(&mine, &any, 1, MPI_INT, MPI_MAX, comm);
    if (any == 0)
      return;
    pattern.extend(zone);
    const rm::Zone* zones[] = {&zone};
    const rm::Pattern* patterns[] = {&pattern};
    rm::preallocate(A, offsets, columns, zones, patterns);
    positions.forget();
    check(KSPReset(ksp));
    check(KSPSetOperators(ksp, A, A));
  }

  void assemble(const Volume& volume, const rm::Zone& zone,
                std::span<const double> x)
  {
    check(VecZeroEntries(b));
    check(MatZeroEntries(A));
    volume.assemble(x, A, b);
    rm::add_residual(zone, b, statistics);
    rm::add_tangent(zone, A, positions, statistics);
    check(VecAssemblyBegin(b));
    check(VecAssemblyEnd(b));
    check(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
    check(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
  }
};

/// Newton's method; returns the number of iterations
int solve(MPI_Comm comm, rm::Zone& zone, const Part& part, Vec x, double scale)
{
  const Volume volume = make_volume(part);
  LinearSystem system(comm, volume, x);
  for (int iterations = 0;; ++iterations)
  {
    const PetscScalar* values = nullptr;
    check(VecGetArrayRead(x, &values));
    const std::span<const double> here(values,
                                       static_cast<std::size_t>(part.rows()));
    update(zone, part, here, scale);
    system.make_room(comm, zone);
    system.assemble(volume, zone, here);
    check(VecRestoreArrayRead(x, &values));
    PetscReal norm = 0.0;
    check(VecNorm(system.b, NORM_2, &norm));
    check(PetscPrintf(comm, "iteration %d: residual %.1e N/mm\n", iterations,
                      static_cast<double>(norm)));
    if (norm < 1e-10 * pressure or iterations == 20)
      return iterations;
    check(KSPSolve(system.ksp, system.b, system.step));
    check(VecAXPY(x, -1.0, system.step));
  }
}

/// Largest relative error of the contact pressure and of the sinking of the
/// upper block, on all ranks
double error(MPI_Comm comm, const Part& part, Vec x, double scale)
{
  const PetscScalar* values = nullptr;
  check(VecGetArrayRead(x, &values));
  const std::span<const double> here(values,
                                     static_cast<std::size_t>(part.rows()));
  double mine = 0.0, worst = 0.0;
  if (part.has_upper)
  {
    for (const double v : here.last(static_cast<std::size_t>(part.multipliers)))
      mine = std::max(mine, std::abs(scale * v / -pressure - 1.0));
    const double exact = -2.0 * pressure * (1.0 - nu * nu) / E;
    const auto top =
        at_nodes(here, upper_block.top(), part.lower - part.begin());
    for (std::size_t k = 1; k < top.size(); k += 2)
      mine = std::max(mine, std::abs(top[k] / exact - 1.0));
  }
  check(VecRestoreArrayRead(x, &values));
  MPI_Allreduce(&mine, &worst, 1, MPI_DOUBLE, MPI_MAX, comm);
  return worst;
}

/// Everything between PetscInitialize and PetscFinalize
double run(MPI_Comm comm)
{
  const Part part(comm);
  rm::Zone zone = make_zone(comm, part);
  // Traction per length, about E / h; it is also the unit of the multiplier's
  // unknowns, which are lengths as the others are
  const double gamma = E * upper_block.cells[0];
  const std::vector<double> everywhere(zone.input().slave.facet_dofs.size(),
                                       gamma);
  zone.set_gamma(everywhere, gamma);
  Vec x = nullptr;
  check(VecCreateMPI(comm, part.rows(), PETSC_DETERMINE, &x));
  const int iterations = solve(comm, zone, part, x, gamma);
  const double worst = error(comm, part, x, gamma);
  check(PetscPrintf(comm, "%d iterations, largest relative error %.1e\n",
                    iterations, worst));
  check(VecDestroy(&x));
  return worst;
}
} // namespace

int main(int argc, char** argv)
{
  if (PetscInitialize(&argc, &argv, nullptr, nullptr) != 0)
    return 1;
  const double worst = run(PETSC_COMM_WORLD);
  check(PetscFinalize());
  return worst < 1e-10 ? 0 : 1;
}
