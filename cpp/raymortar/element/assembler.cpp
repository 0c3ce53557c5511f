#include "raymortar/element/assembler.h"
#include "raymortar/core/error.h"

namespace raymortar
{
void require_degree(const ContactState& s)
{
  if (s.multipliers.components == 0)
    return;
  const int degree = s.multipliers.degree;
  const int highest = s.slave.shape == Shape::interval ? s.slave.degree : 1;
  if (degree < 1 or degree > highest)
    throw Error("multiplier of degree " + std::to_string(degree) +
                " on facets with displacement of degree " +
                std::to_string(s.slave.degree) +
                ": 2D takes up to the displacement's degree, 3D takes 1");
}

std::vector<double> slips_without_friction(ContactState s)
{
  s.friction = Coulomb{};
  s.method = Method::penalty;
  s.condition = Condition::points;
  s.multipliers = {};
  return make_assembler(s)->results(s).slip;
}

std::unique_ptr<Assembler> make_assembler(const ContactState& s)
{
  require_degree(s);
  return s.slave.gdim == 2 ? assembler_in<2>(s) : assembler_in<3>(s);
}
} // namespace raymortar
