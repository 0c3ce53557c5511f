#include "raymortar/ties/tie_term.h"
#include "raymortar/element/free_tools.h"
#include "raymortar/interface/cover_term.h"
#include "raymortar/interface/damping_term.h"
#include "raymortar/ties/rigid_tie.h"

namespace raymortar
{
namespace
{
Unknowns tied_unknowns(const ContactState& s, std::size_t e)
{
  return element_unknowns(s.elements.slave[e], s.master_of(e),
                          free_tool_of(s, e));
}
} // namespace

void TieTerm::set_up(ContactState& s)
{
  count_hits_as_cover(s);
  _kernel->set_up(s);
  _is_set_up = true;
}

void TieTerm::take_gamma(const ContactState& s)
{
  if (_is_set_up and s.multipliers.components == 0)
    _kernel->set_up(s);
}

void TieTerm::add_needs(const ContactState& s, PatternNeeds& needs) const
{
  for (std::size_t e = 0; e < s.elements.size(); ++e)
    if (const Index m = s.master_of(e); m != no_index)
      needs.pairs.push_back({s.elements.slave[e], m});
}

Work TieTerm::residual(const ContactState& s, VectorSink& sink) const
{
  Work work;
  _kernel->residual(
      s,
      [&](std::size_t e, const double* block, int size)
      {
        ++work.computed;
        sink.add(tied_unknowns(s, e), {block, static_cast<std::size_t>(size)});
      });
  return work;
}

Work TieTerm::tangent(const ContactState& s, MatrixSink& sink) const
{
  std::vector<std::size_t> wanted;
  for (std::size_t e = 0; e < s.elements.size(); ++e)
    if (s.elements.master[e] != no_index and sink.wants(tied_unknowns(s, e)))
      wanted.push_back(e);
  _kernel->tangent(s, wanted,
                   [&](std::size_t e, const double* block, int) {
                     sink.add(tied_unknowns(s, e), tied_unknowns(s, e), block);
                   },
                   {});
  return {static_cast<std::int64_t>(wanted.size()), 0};
}

void TieTerms::prepare(ContactState& s) const
{
  s.condition = Condition::points;
  s.friction = Stick{};
}

std::vector<std::unique_ptr<Term>> TieTerms::make(const ContactState& s,
                                                  bool) const
{
  std::vector<std::unique_ptr<Term>> terms;
  const int gdim = s.slave.gdim;
  terms.push_back(std::make_unique<TieTerm>(s.has_tools()
                                                ? make_rigid_tie_kernel(gdim)
                                                : make_tie_kernel(_gap, gdim)));
  terms.push_back(std::make_unique<DampingTerm>());
  terms.push_back(std::make_unique<CoverTerm>(s));
  return terms;
}
} // namespace raymortar
