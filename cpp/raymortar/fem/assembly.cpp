#include "raymortar/fem/assembly.h"
#include "raymortar/element/law_gaps.h"
#include "raymortar/fem/facet_dofs.h"
#include "raymortar/fem/facet_terms.h"
#include "raymortar/fem/rows.h"
#include "raymortar/fem/stopwatch.h"
#include "raymortar/geometry/predicates.h"
#include <algorithm>
#include <optional>

namespace raymortar
{
namespace
{
void ignore_left_out(::Vec b)
{
  check(VecSetOption(b, VEC_IGNORE_NEGATIVE_INDICES, PETSC_TRUE),
        "VecSetOption");
}

/// Whether a facet has a nonzero among values (dofs, gdim)
bool any_nonzero(const Surface& s, Index facet, std::span<const double> values)
{
  bool any = false;
  for_facet_dofs(s, facet,
                 [&](std::size_t k) { any = any or values[k] != 0.0; });
  return any;
}

/// Dirichlet increment of an element in the order of ElementLayout
void element_increment(const ContactState& s, Index f, Index m,
                       std::span<const double> slave,
                       std::span<const double> master, std::vector<double>& du)
{
  du.clear();
  append_values(s.slave, f, slave, du);
  if (s.multipliers.components > 0)
    du.insert(du.end(),
              s.multipliers.facet.size() /
                  static_cast<std::size_t>(s.slave.num_facets()) *
                  static_cast<std::size_t>(s.multipliers.components),
              0.0);
  if (m != no_index)
    append_values(s.master, m, master, du);
}

/// Masters, other than the element's own, that its segments' vertices hang on
std::vector<Index> coupled_masters(const ContactState& s, std::size_t e)
{
  std::vector<Index> masters;
  for (const Index q : s.elements.points_of(e))
  {
    const Index segment = s.points.segment[static_cast<std::size_t>(q)];
    if (not s.moving_segments or segment == no_index)
      continue;
    const Index m =
        s.segmentation.segments[static_cast<std::size_t>(segment)].master;
    if (m != s.elements.master[e])
      masters.push_back(m);
  }
  std::sort(masters.begin(), masters.end());
  masters.erase(std::unique(masters.begin(), masters.end()), masters.end());
  return masters;
}

/// Elements whose tangent is not zero: without a multiplier, those with a
/// point that is closed
std::vector<std::size_t> working_elements(const ContactState& s)
{
  std::vector<std::size_t> working;
  working.reserve(s.elements.size());
  const bool all = s.multipliers.components > 0;
  // No facet's own tolerance is larger
  const double touch =
      all ? 0.0 : tolerance::touch * largest_diameter(s.slave, s.slave.x);
  const std::vector<double> gaps = all ? std::vector<double>() : law_gaps(s);
  const auto closed = [&](Index q)
  { return gaps[static_cast<std::size_t>(q)] <= touch; };
  for (std::size_t e = 0; e < s.elements.size(); ++e)
  {
    const auto points = s.elements.points_of(e);
    if (all or (s.elements.master[e] != no_index and
                std::any_of(points.begin(), points.end(), closed)))
      working.push_back(e);
  }
  return working;
}

/// Adds tangent blocks: straight to the entries of rows of this rank, through
/// PETSc to those of other ranks
class BlockWriter
{
public:
  BlockWriter(const Zone& zone, ::Mat A, BlockPositions& positions)
      : _zone(zone), _matrix(A), _positions(positions)
  {
    open();
  }

  void add(Index slave, Index master, const double* block)
  {
    element_rows(_zone, slave, master, Constrained::left_out, _rows);
    if (not _arrays->available())
      return set_values(_rows, block);
    const auto at = _positions.of(*_arrays, _zone, slave, master);
    if (not at.known)
    {
      // Where PETSc makes a new entry, the arrays are others afterwards
      _arrays.reset();
      set_values(_rows, block);
      return open();
    }
    add_block(*_arrays, at, _rows, without_constrained(block));
    if (not at.has_foreign)
      return;
    _foreign = _rows;
    for (PetscInt& row : _foreign)
      row = _arrays->owns(row) ? -1 : row;
    set_values(_foreign, block);
  }

  /// Rows of one master in the columns of another: few, so that their places
  /// are not kept
  void add_masters(Index hit, Index other, const double* block)
  {
    master_rows(_zone, hit, Constrained::left_out, _foreign);
    master_rows(_zone, other, Constrained::left_out, _rows);
    _arrays.reset();
    set_values(_foreign, block);
    open();
  }

private:
  void open()
  {
    _arrays.emplace(_matrix);
    if (_arrays->available())
      _positions.follow(_matrix, _zone);
  }

  /// PETSc leaves out rows and columns numbered -1
  void set_values(const std::vector<PetscInt>& rows, const double* block)
  {
    check(MatSetValues(_matrix, static_cast<PetscInt>(rows.size()), rows.data(),
                       static_cast<PetscInt>(_rows.size()), _rows.data(), block,
                       ADD_VALUES),
          "MatSetValues");
  }

  /// The block with zeros in the columns that are left out
  const double* without_constrained(const double* block)
  {
    const std::size_t n = _rows.size();
    if (std::none_of(_rows.begin(), _rows.end(),
                     [](PetscInt row) { return row < 0; }))
      return block;
    _masked.assign(block, block + n * n);
    for (std::size_t k = 0; k < n * n; ++k)
      if (_rows[k % n] < 0)
        _masked[k] = 0.0;
    return _masked.data();
  }

  const Zone& _zone;
  ::Mat _matrix;
  std::optional<AijArrays> _arrays;
  BlockPositions& _positions;
  std::vector<PetscInt> _rows, _foreign;
  std::vector<double> _masked;
};
} // namespace

void add_residual(Zone& zone, ::Vec b)
{
  const Stopwatch watch(zone.assembly().seconds_residual);
  const ContactState& s = zone.state();
  ignore_left_out(b);
  std::vector<PetscInt> rows;
  zone.assembler().residual(
      s,
      [&](std::size_t e, const double* block, int size)
      {
        element_rows(zone, s.elements.slave[e], s.elements.master[e],
                     Constrained::left_out, rows);
        check(VecSetValues(b, size, rows.data(), block, ADD_VALUES),
              "VecSetValues");
      });
  add_facet_residuals(zone, b);
  zone.assembly().residual_blocks +=
      static_cast<std::int64_t>(s.elements.size());
}

void add_tangent(Zone& zone, ::Mat A, BlockPositions& positions)
{
  AssemblyStatistics& statistics = zone.assembly();
  const Stopwatch watch(statistics.seconds_tangent);
  const ContactState& s = zone.state();
  const auto elements = working_elements(s);
  {
    BlockWriter writer(zone, A, positions);
    zone.assembler().tangent(
        s, elements,
        [&](std::size_t e, const double* block, int)
        { writer.add(s.elements.slave[e], s.elements.master[e], block); },
        [&](std::size_t e, Index master, const double* block, int,
            const double* hit_rows)
        {
          writer.add(s.elements.slave[e], master, block);
          if (hit_rows)
            writer.add_masters(s.elements.master[e], master, hit_rows);
        });
  }
  add_facet_tangents(zone, A);
  statistics.tangent_blocks += static_cast<std::int64_t>(elements.size());
  statistics.skipped_blocks +=
      static_cast<std::int64_t>(s.elements.size() - elements.size());
  statistics.lookups = positions.lookups();
}

void apply_lifting(Zone& zone, ::Vec b, std::span<const double> slave,
                   std::span<const double> master, double alpha)
{
  const ContactState& s = zone.state();
  std::vector<std::size_t> lifted = working_elements(s);
  const auto moves = [&](Index m)
  { return m != no_index and any_nonzero(s.master, m, master); };
  std::erase_if(lifted,
                [&](std::size_t e)
                {
                  const auto coupled = coupled_masters(s, e);
                  return not any_nonzero(s.slave, s.elements.slave[e],
                                         slave) and
                         not moves(s.elements.master[e]) and
                         std::none_of(coupled.begin(), coupled.end(), moves);
                });
  ignore_left_out(b);
  std::vector<PetscInt> rows;
  std::vector<double> change, increment;
  // A block of these rows times the increment
  const auto lift = [&](const double* block)
  {
    change.assign(rows.size(), 0.0);
    for (std::size_t i = 0; i < rows.size(); ++i)
      for (std::size_t j = 0; j < increment.size(); ++j)
        change[i] -= alpha * block[i * increment.size() + j] * increment[j];
    check(VecSetValues(b, static_cast<PetscInt>(rows.size()), rows.data(),
                       change.data(), ADD_VALUES),
          "VecSetValues");
  };
  const auto lift_pair = [&](Index f, Index m, const double* block)
  {
    element_rows(zone, f, m, Constrained::left_out, rows);
    element_increment(s, f, m, slave, master, increment);
    lift(block);
  };
  zone.assembler().tangent(
      s, lifted,
      [&](std::size_t e, const double* block, int)
      { lift_pair(s.elements.slave[e], s.elements.master[e], block); },
      [&](std::size_t e, Index m, const double* block, int,
          const double* hit_rows)
      {
        lift_pair(s.elements.slave[e], m, block);
        if (not hit_rows)
          return;
        master_rows(zone, s.elements.master[e], Constrained::left_out, rows);
        increment.clear();
        append_values(s.master, m, master, increment);
        lift(hit_rows);
      });
  lift_facet_tangents(zone, b, slave, master, alpha);
  zone.assembly().lifted_blocks += static_cast<std::int64_t>(lifted.size());
}
} // namespace raymortar
