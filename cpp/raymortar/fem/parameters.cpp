#include "raymortar/fem/parameters.h"
#include "raymortar/fem/rows.h"

namespace raymortar
{
namespace
{
/// Adds blocks with all of their rows and columns
class WholeWriter final : public MatrixSink
{
public:
  WholeWriter(const Zone& zone, PetscMatrix A) : _zone(zone), _matrix(A) {}

  [[nodiscard]] bool wants(const Unknowns&) const override { return true; }

  void add(const Unknowns& rows, const Unknowns& columns,
           const double* block) override
  {
    global_rows(_zone, rows, Constrained::kept, _rows);
    global_rows(_zone, columns, Constrained::kept, _columns);
    check(MatSetValues(_matrix, static_cast<PetscInt>(_rows.size()),
                       _rows.data(), static_cast<PetscInt>(_columns.size()),
                       _columns.data(), block, ADD_VALUES),
          "MatSetValues");
  }

private:
  const Zone& _zone;
  PetscMatrix _matrix;
  std::vector<PetscInt> _rows, _columns;
};
} // namespace

void add_by_parameter(const Zone& zone, PetscMatrix A, const Parameter& by)
{
  WholeWriter writer(zone, A);
  for (const auto& term : zone.interface().terms())
    term->by_parameter(zone.state(), by, writer);
}
} // namespace raymortar
