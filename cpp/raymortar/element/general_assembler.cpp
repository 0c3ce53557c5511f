#include "raymortar/element/general_assembler.h"

namespace raymortar
{
std::vector<double> slips_without_friction(ContactState s)
{
  s.friction = Coulomb{};
  s.method = Method::penalty;
  s.condition = Condition::points;
  s.multipliers = {};
  return make_general_assembler(s)->results(s).slip;
}

std::unique_ptr<Assembler>
make_general_assembler(const ContactState& s,
                       std::shared_ptr<const DualField> dual)
{
  return s.slave.gdim == 2 ? general_assembler_in<2>(s, dual)
                           : general_assembler_in<3>(s, dual);
}
} // namespace raymortar
