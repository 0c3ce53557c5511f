// Families of pairs of plane facets, from harmless to adversarial.
#pragma once

#include "geometry/facets.h"
#include <string>

namespace raymortar::test
{
struct PlanePair
{
  Facet slave;
  Facet master;
};

struct Family
{
  std::string name;
  PlanePair (*make)(std::mt19937& random);
};

/// Random facets; slivers to 1e-8; 1e6 sizes from the origin; all but
/// coincident to 1e-16; corner on edge; edge on edge; shared lattice points;
/// sizes 1 : 1e-6; all of it at once
const std::vector<Family>& plane_families();

double uniform(std::mt19937& random, double from, double to);

/// 10^e with e uniform
double log_uniform(std::mt19937& random, double from, double to);
} // namespace raymortar::test
