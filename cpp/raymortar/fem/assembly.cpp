#include "raymortar/fem/assembly.h"
#include "raymortar/core/stopwatch.h"
#include "raymortar/element/free_tools.h"
#include "raymortar/fem/rows.h"
#include "raymortar/pairing/facet_dofs.h"
#include <algorithm>
#include <optional>

namespace raymortar
{
namespace
{
/// Whether a facet has a nonzero among values (dofs, gdim)
bool any_nonzero(const Surface& s, Index facet, std::span<const double> values)
{
  bool any = false;
  for_facet_dofs(s, facet,
                 [&](std::size_t k) { any = any or values[k] != 0.0; });
  return any;
}

/// Adds blocks of a residual to a vector
class VectorWriter final : public VectorSink
{
public:
  VectorWriter(const Zone& zone, PetscVector b) : _zone(zone), _vector(b)
  {
    check(VecSetOption(b, VEC_IGNORE_NEGATIVE_INDICES, PETSC_TRUE),
          "VecSetOption");
  }

  void add(const Unknowns& rows, std::span<const double> values) override
  {
    global_rows(_zone, rows, Constrained::left_out, _rows);
    check(VecSetValues(_vector, static_cast<PetscInt>(_rows.size()),
                       _rows.data(), values.data(), ADD_VALUES),
          "VecSetValues");
  }

private:
  const Zone& _zone;
  PetscVector _vector;
  std::vector<PetscInt> _rows;
};

/// Adds tangent blocks times - alpha and an increment of the displacements
class Lifting final : public MatrixSink
{
public:
  /// @param[in] slave, master (dofs, gdim)
  Lifting(const Zone& zone, PetscVector b, std::span<const double> slave,
          std::span<const double> master, double alpha)
      : _state(zone.state()), _slave(slave), _master(master), _alpha(alpha),
        _vector(zone, b)
  {
  }

  [[nodiscard]] bool wants(const Unknowns& columns) const override
  {
    return (columns.slave != no_index and
            any_nonzero(_state.slave, columns.slave, _slave)) or
           (columns.master != no_index and
            any_nonzero(_state.master, columns.master, _master));
  }

  void add(const Unknowns& rows, const Unknowns& columns,
           const double* block) override
  {
    find_increment(columns);
    const std::size_t n = _increment.size();
    _change.assign(size_of(rows), 0.0);
    for (std::size_t i = 0; i < _change.size(); ++i)
      for (std::size_t j = 0; j < n; ++j)
        _change[i] -= _alpha * block[i * n + j] * _increment[j];
    _vector.add(rows, _change);
  }

private:
  [[nodiscard]] std::size_t multipliers_per_facet() const
  {
    const Multipliers& m = _state.multipliers;
    return m.facet.size() /
           static_cast<std::size_t>(_state.slave.num_facets()) *
           static_cast<std::size_t>(m.components);
  }

  [[nodiscard]] std::size_t size_of(const Unknowns& unknowns) const
  {
    const auto side = static_cast<std::size_t>(_state.slave.dofs_per_facet() *
                                               _state.slave.gdim);
    return (unknowns.slave != no_index ? side : 0) +
           (unknowns.multiplier != no_index ? multipliers_per_facet() : 0) +
           (unknowns.master != no_index ? side : 0) + tool_unknowns(unknowns);
  }

  [[nodiscard]] std::size_t tool_unknowns(const Unknowns& unknowns) const
  {
    if (unknowns.tool == no_index)
      return 0;
    return freedom_of(_state, unknowns.tool).rates.size();
  }

  /// Multipliers and free tools have no increment
  void find_increment(const Unknowns& columns)
  {
    _increment.clear();
    if (columns.slave != no_index)
      append_values(_state.slave, columns.slave, _slave, _increment);
    if (columns.multiplier != no_index)
      _increment.insert(_increment.end(), multipliers_per_facet(), 0.0);
    if (columns.master != no_index)
      append_values(_state.master, columns.master, _master, _increment);
    _increment.insert(_increment.end(), tool_unknowns(columns), 0.0);
  }

  const ContactState& _state;
  std::span<const double> _slave, _master;
  double _alpha;
  VectorWriter _vector;
  std::vector<double> _increment, _change;
};

/// Adds tangent blocks: straight to the entries of rows of this rank, through
/// PETSc to those of other ranks
class BlockWriter final : public MatrixSink
{
public:
  BlockWriter(const Zone& zone, PetscMatrix A, BlockPositions& positions)
      : _zone(zone), _matrix(A), _positions(positions)
  {
    open();
  }

  [[nodiscard]] bool wants(const Unknowns&) const override { return true; }

  void add(const Unknowns& rows, const Unknowns& columns,
           const double* block) override
  {
    if (rows == columns and rows.slave != no_index and rows.tool == no_index)
      add_element(rows.slave, rows.master, block);
    else
      add_other(rows, columns, block);
  }

private:
  void add_element(Index slave, Index master, const double* block)
  {
    element_rows(_zone, slave, master, Constrained::left_out, _rows);
    if (not _arrays)
      open();
    if (not _arrays->available())
      return set_values(_rows, block);
    const auto at = _positions.of(*_arrays, _zone, slave, master);
    if (not at.known)
    {
      // A new entry moves the arrays of PETSc
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

  /// Blocks of few unknowns, or of few facets: their places are not kept
  void add_other(const Unknowns& rows, const Unknowns& columns,
                 const double* block)
  {
    _arrays.reset();
    global_rows(_zone, rows, Constrained::left_out, _foreign);
    global_rows(_zone, columns, Constrained::left_out, _rows);
    set_values(_foreign, block);
  }

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
  PetscMatrix _matrix;
  std::optional<AijArrays> _arrays;
  BlockPositions& _positions;
  std::vector<PetscInt> _rows, _foreign;
  std::vector<double> _masked;
};
} // namespace

void add_residual(const Zone& zone, PetscVector b,
                  AssemblyStatistics& statistics)
{
  const Stopwatch watch(statistics.seconds_residual);
  VectorWriter writer(zone, b);
  for (const auto& term : zone.interface().terms())
    statistics.residual_blocks += term->residual(zone.state(), writer).computed;
}

void add_tangent(const Zone& zone, PetscMatrix A, BlockPositions& positions,
                 AssemblyStatistics& statistics)
{
  const Stopwatch watch(statistics.seconds_tangent);
  BlockWriter writer(zone, A, positions);
  for (const auto& term : zone.interface().terms())
  {
    const Work work = term->tangent(zone.state(), writer);
    statistics.tangent_blocks += work.computed;
    statistics.skipped_blocks += work.skipped;
  }
  statistics.lookups = positions.lookups();
}

void apply_lifting(const Zone& zone, PetscVector b,
                   std::span<const double> slave,
                   std::span<const double> master, double alpha,
                   AssemblyStatistics& statistics)
{
  Lifting lifting(zone, b, slave, master, alpha);
  for (const auto& term : zone.interface().terms())
    statistics.lifted_blocks += term->tangent(zone.state(), lifting).computed;
}
} // namespace raymortar
