// raymortar without Python: arrays, MPI and PETSc.
//
// A block under pressure stands on another; their meshes do not match. The
// first rank has the lower block, the last rank the upper one: neither knows
// a node of the other's. The pressure between them must be uniform.
#include "volume.h"
#include <cmath>
#include <numeric>
#include <petscksp.h>
#include <raymortar/fem/pattern.h>
#include <raymortar/system/contact_system.h>

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

std::vector<rm::GlobalIndex> numbers(std::size_t count, rm::GlobalIndex first)
{
  std::vector<rm::GlobalIndex> all(count);
  std::iota(all.begin(), all.end(), first);
  return all;
}

/// Contact of the two blocks, and the values of this rank that it depends on
struct Contact
{
  rm::Zone zone;
  std::vector<double> u, multiplier;
  rm::CoupledValues values;     ///< moves these from and to vectors of unknowns
  rm::BlockPositions positions; ///< of contact's blocks in the matrix
  rm::AssemblyStatistics statistics;
  rm::ContactSystem system;

  Contact(MPI_Comm comm, const Part& part)
      : zone(make_zone(comm, part)), u(static_cast<std::size_t>(part.bodies())),
        multiplier(zone.input().multipliers.row.size()),
        values(comm, {{u, u.size()}}, numbers(u.size(), part.begin()),
               {multiplier_values()}, {}),
        system({system_zone(part)}, u, values)
  {
  }
  Contact(const Contact&) = delete;
  Contact& operator=(const Contact&) = delete;

private:
  rm::MultiplierValues multiplier_values()
  {
    std::vector<rm::Index> nodes(multiplier.size());
    std::iota(nodes.begin(), nodes.end(), 0);
    return {multiplier, nodes, zone.input().multipliers.row, 1};
  }

  rm::SystemZone system_zone(const Part& part)
  {
    rm::SystemZone one;
    one.zone = &zone;
    one.positions = &positions;
    one.statistics = &statistics;
    const int before = part.has_lower ? lower_block.num_nodes() : 0;
    if (part.has_lower)
      one.master = lower_block.top();
    if (part.has_upper)
      for (const int node : upper_block.bottom())
        one.slave.push_back(before + node);
    one.nodes = multiplier_values().owned;
    return one;
  }
};

/// A direct solver whose matrix has room for the pairs that were found
struct LinearSystem
{
  Mat A = nullptr;
  KSP ksp = nullptr;
  Vec b = nullptr, step = nullptr;
  std::vector<std::int32_t> offsets, columns; ///< of the volume
  rm::Pattern pattern;                        ///< of contact

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

  void make_room(MPI_Comm comm, Contact& contact)
  {
    const int mine = pattern.covers(contact.zone) ? 0 : 1;
    int any = 0;
    MPI_Allreduce(&mine, &any, 1, MPI_INT, MPI_MAX, comm);
    if (any == 0)
      return;
    pattern.extend(contact.zone);
    const rm::Zone* zones[] = {&contact.zone};
    const rm::Pattern* patterns[] = {&pattern};
    rm::preallocate(A, offsets, columns, zones, patterns);
    contact.positions.forget();
    check(KSPReset(ksp));
    check(KSPSetOperators(ksp, A, A));
  }

  void assemble(const Volume& volume, const Contact& contact)
  {
    check(VecZeroEntries(b));
    check(MatZeroEntries(A));
    volume.assemble(contact.u, A, b);
    contact.system.add_residual(b);
    contact.system.add_tangent(A);
    check(VecAssemblyBegin(b));
    check(VecAssemblyEnd(b));
    check(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
    check(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
  }
};

/// Newton's method; returns the number of iterations
int solve(MPI_Comm comm, Contact& contact, const Part& part, double scale)
{
  Vec x = nullptr;
  check(VecCreateMPI(comm, part.rows(), PETSC_DETERMINE, &x));
  const Volume volume = make_volume(part);
  LinearSystem system(comm, volume, x);
  const std::vector<double> scales{scale};
  for (int iterations = 0;; ++iterations)
  {
    contact.system.set_unknowns(x, scales, true);
    contact.system.pair(false);
    system.make_room(comm, contact);
    system.assemble(volume, contact);
    PetscReal norm = 0.0;
    check(VecNorm(system.b, NORM_2, &norm));
    check(PetscPrintf(comm, "iteration %d: residual %.1e N/mm\n", iterations,
                      static_cast<double>(norm)));
    if (norm < 1e-10 * pressure or iterations == 20)
    {
      check(VecDestroy(&x));
      return iterations;
    }
    check(KSPSolve(system.ksp, system.b, system.step));
    check(VecAXPY(x, -1.0, system.step));
  }
}

/// Largest relative error of the contact pressure and of the sinking of the
/// upper block, on all ranks
double error(MPI_Comm comm, const Part& part, const Contact& contact)
{
  double mine = 0.0, worst = 0.0;
  for (const double value : contact.multiplier)
    mine = std::max(mine, std::abs(value / -pressure - 1.0));
  const double exact = -2.0 * pressure * (1.0 - nu * nu) / E;
  const int before = part.has_lower ? lower_block.num_nodes() : 0;
  if (part.has_upper)
    for (const int node : upper_block.top())
    {
      const auto y = static_cast<std::size_t>(2 * (before + node) + 1);
      mine = std::max(mine, std::abs(contact.u[y] / exact - 1.0));
    }
  MPI_Allreduce(&mine, &worst, 1, MPI_DOUBLE, MPI_MAX, comm);
  return worst;
}

/// Everything between PetscInitialize and PetscFinalize
double run(MPI_Comm comm)
{
  const Part part(comm);
  Contact contact(comm, part);
  // Traction per length, about E / h; it is also the unit of the multiplier's
  // unknowns, which are lengths as the others are
  const double gamma = E * upper_block.cells[0];
  const std::vector<double> everywhere(
      contact.zone.input().slave.facet_dofs.size(), gamma);
  contact.zone.set_gamma(everywhere, gamma);
  const int iterations = solve(comm, contact, part, gamma);
  const double worst = error(comm, part, contact);
  check(PetscPrintf(comm, "%d iterations, largest relative error %.1e\n",
                    iterations, worst));
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
