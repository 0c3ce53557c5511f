// robustness [PAIRS [SEED]]
//
// Clips, projects and casts rays for a million (PAIRS) random and adversarial
// pairs of facets and compares with exact arithmetic. Prints, per family, the
// worst errors, failures and pairs per second, and fails if there is a failure.
#include "checks.h"
#include <cstdio>
#include <cstdlib>

using namespace raymortar::test;

namespace
{
constexpr int batch = 1000;

void print(const char* name, const Errors& e)
{
  std::printf("%-28s %9lld %9lld  %9.1e %9.2f %9.2f %11.0f\n", name,
              static_cast<long long>(e.tried),
              static_cast<long long>(e.failures), e.area, e.roundings, e.point,
              static_cast<double>(e.tried) / e.seconds);
  std::fflush(stdout);
}

/// Runs a check in batches until `pairs` are done
template <class Check>
Errors run(const std::string& name, std::int64_t pairs, Check check)
{
  Errors errors;
  while (errors.tried < pairs)
    errors.add(check());
  print(name.c_str(), errors);
  return errors;
}
} // namespace

int main(int argc, char** argv)
{
  const std::int64_t pairs = argc > 1 ? std::atoll(argv[1]) : 1000000;
  std::mt19937 random(argc > 2 ? static_cast<unsigned>(std::atoi(argv[2])) : 1);
  const auto& families = plane_families();
  const auto share = pairs / static_cast<std::int64_t>(families.size() + 2) + 1;
  std::printf("%-28s %9s %9s  %9s %9s %9s %11s\n", "family", "tried",
              "failures", "area", "roundings", "point", "per second");
  Errors all;
  for (const Family& family : families)
    all.add(run(family.name, share,
                [&]
                {
                  std::vector<PlanePair> made;
                  for (int k = 0; k < batch; ++k)
                    made.push_back(family.make(random));
                  return check_clips(made);
                }));
  all.add(run("triangles in space", share,
              [&] { return check_projections(random, batch); }));
  all.add(run("rays", share, [&] { return check_rays(random, batch); }));
  print("all", all);
  std::printf(
      "area: error by the smaller facet's area (in space: the slave's)\n"
      "roundings, point: errors by what rounding may do; a failure "
      "above %g\n",
      allowed_roundings);
  return all.failures == 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}
