// Nanoseconds a point of the element kernel, on pairs of facets and on rigid
// tools.
#include "raymortar/element/assembler.h"
#include "raymortar/mortar/tool_rays.h"
#include "raymortar/mortar/whole_facets.h"
#include "raymortar/rigid/shapes.h"
#include "raymortar/target/freedom.h"
#include "rules.h"
#include "surfaces.h"
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string>

namespace raymortar::test
{
namespace
{
struct Law
{
  const char* name;
  Method method;
  bool has_friction;
  bool has_multiplier;
  bool is_vector;
};

constexpr std::array<Law, 5> laws = {
    {{"penalty", Method::penalty, false, false, false},
     {"frictional penalty", Method::penalty, true, false, false},
     {"scalar multiplier", Method::augmented_lagrangian, false, true, false},
     {"vector multiplier", Method::augmented_lagrangian, false, true, true},
     {"friction", Method::augmented_lagrangian, true, true, true}}};

struct Kind
{
  Shape shape;
  const char* name;
  int degree;
  int n; ///< cells along each direction
};

constexpr std::array<Kind, 6> kinds = {
    {{Shape::interval, "interval", 1, 600},
     {Shape::interval, "interval", 2, 300},
     {Shape::triangle, "triangle", 1, 10},
     {Shape::triangle, "triangle", 2, 6},
     {Shape::quadrilateral, "quadrilateral", 1, 10},
     {Shape::quadrilateral, "quadrilateral", 2, 6}}};

double cpu_seconds()
{
  timespec t;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// Two bent surfaces pressed into each other by a fiftieth of a facet, in the
/// second step
class Scene
{
public:
  Scene(const Kind& kind, const Law& law)
      : _kind(kind), _law(law), _h(1.6 / kind.n)
  {
    const auto wave = [](double x, double y)
    { return 0.03 * std::sin(2.0 * x + 0.3) - 0.02 * x * y; };
    state.slave = surface(
        kind.n, false,
        graph(0.8, [&](double x, double y) { return wave(x, y) - 0.02 * _h; }));
    state.master = surface(kind.n + 1, true, graph(0.9, wave));
    for (Surface* s : {&state.slave, &state.master})
      for (double& x : s->x)
        x += number(0.004 * _h);
    set_law();
  }

  ContactState state;

  /// Pair the two surfaces
  void pair(bool moving_segments)
  {
    const FacetDistances distances(0.5, 0.5);
    state.segmentation =
        segments_of(state.slave, state.master, {distances, false});
    lay_points();
    state.hits = cast_rays(state.slave, state.master, state.points, distances);
    state.elements = group_points(state.points, state.hits);
    state.moving_segments = moving_segments;
  }

  /// Meet a tool in place of the master
  void meet(const PlacedTool& tool)
  {
    const int gdim = state.slave.gdim;
    state.master = {};
    state.master.gdim = gdim;
    state.tools = {tool};
    state.segmentation = whole_facets(state.slave);
    lay_points();
    state.hits = cast_on_tools(state.slave, state.tools, state.points,
                               FacetDistances(1.0, 1.0));
    state.elements = group_points(state.points, state.hits);
  }

  [[nodiscard]] double points() const
  {
    return static_cast<double>(
        std::count_if(state.points.seed.begin(), state.points.seed.end(),
                      [](Index seed) { return seed != no_index; }));
  }

private:
  [[nodiscard]] Surface surface(int n, bool up, const Map& map) const
  {
    return make_surface({_kind.shape, _kind.degree, _kind.degree, n, up}, map);
  }

  double number(double size)
  {
    return std::uniform_real_distribution<double>(-size, size)(_random);
  }

  void set_law()
  {
    ContactState& s = state;
    const auto d = static_cast<std::size_t>(s.slave.gdim);
    const std::size_t dofs = s.slave.facet_dofs.size();
    s.gamma.nodal.assign(dofs, 5.0);
    s.method = _law.method;
    if (_law.has_friction)
    {
      s.friction = Coulomb{0.3};
      for (std::size_t k = 0; k < d * dofs; ++k)
        s.traction_old.nodal.push_back(number(0.01 * _h));
    }
    if (not _law.has_multiplier)
      return;
    Multipliers& m = s.multipliers;
    m.degree = 1;
    m.components = _law.is_vector ? s.slave.gdim : 1;
    const Index nodes = s.slave.corners() * s.slave.num_facets();
    for (Index k = 0; k < nodes; ++k)
    {
      m.facet.push_back(k);
      m.row.push_back(0);
      for (int i = 0; i < m.components; ++i)
        m.value.push_back(number(0.2));
    }
  }

  void lay_points()
  {
    const int degree = 2 * _kind.degree;
    state.segment_rules = segment_rules(_kind.shape, degree);
    state.points =
        make_points(state.slave, state.segmentation, state.segment_rules,
                    rule_on(_kind.shape, degree), _law.has_multiplier);
  }

  Kind _kind;
  Law _law;
  double _h;
  std::mt19937 _random{7};
};

/// A plane below, or a large ball; turned since the accepted step, or free
PlacedTool tool_of(const std::string& name, int gdim)
{
  const Vec<3> up = Vec<3>::Unit(gdim - 1);
  const Vec<3> axis =
      gdim == 2 ? Vec<3>(0.0, 0.0, 1.0) : Vec<3>(0.3, 0.2, 1.0).normalized();
  PlacedTool tool;
  tool.tool = name == "sphere" ? make_sphere(-10.0 * up, 10.05, {})
                               : make_plane(0.05 * up, up);
  if (name == "turned plane")
    tool.now.rotation = Eigen::AngleAxisd(0.01, axis).toRotationMatrix();
  if (name != "free plane")
    return tool;
  Freedom freedom;
  for (int j = 0; j < gdim; ++j)
    freedom.rates.push_back({Vec<3>::Unit(j), Mat<3, 3>::Zero()});
  for (int j = gdim == 2 ? 2 : 0; j < 3; ++j)
  {
    Mat<3, 3> spin = Mat<3, 3>::Zero();
    spin((j + 2) % 3, (j + 1) % 3) = 1.0;
    spin((j + 1) % 3, (j + 2) % 3) = -1.0;
    freedom.rates.push_back({Vec<3>::Zero(), spin});
  }
  const std::size_t n = freedom.rates.size();
  freedom.bends.assign(n * n, Mat<3, 3>::Zero());
  freedom.rows.assign(n, 0);
  tool.tool = with_freedom(tool.tool, freedom);
  return tool;
}

/// Nanoseconds a point, the least of some runs
struct Cost
{
  double residual = 1e300;
  double tangent = 1e300;

  void take(const Assembler& assembler, const Scene& scene)
  {
    const ContactState& s = scene.state;
    const double points = scene.points();
    const int runs = std::max(1, static_cast<int>(4e4 / points));
    std::vector<std::size_t> all(s.elements.size());
    std::iota(all.begin(), all.end(), std::size_t(0));
    double sum = 0.0; // so that nothing is left out
    const auto block = [&sum](std::size_t, const double* b, int)
    { sum += b[0]; };
    const auto coupling = [&sum](std::size_t, Index, const double* b, int,
                                 const double*) { sum += b[0]; };
    const auto time = [&](auto&& call)
    {
      const double start = cpu_seconds();
      for (int k = 0; k < runs; ++k)
        call();
      return 1e9 * (cpu_seconds() - start) / (runs * points);
    };
    residual = std::min(residual, time([&] { assembler.residual(s, block); }));
    tangent = std::min(
        tangent, time([&] { assembler.tangent(s, all, block, coupling); }));
    if (std::isnan(sum))
      std::puts("not a number");
  }
};

void time(const Kind& kind, const Law& law, const std::string& target,
          const Scene& scene, int repeats)
{
  const auto assembler = make_assembler(scene.state);
  Cost cost;
  for (int k = 0; k < repeats; ++k)
    cost.take(*assembler, scene);
  std::printf("%s,%d,%s,%s,%.1f,%.1f\n", kind.name, kind.degree, law.name,
              target.c_str(), cost.residual, cost.tangent);
  std::fflush(stdout);
}

void time_pairs(const Kind& kind, const Law& law, int repeats)
{
  Scene scene(kind, law);
  for (const bool moving : {false, true})
  {
    scene.pair(moving);
    time(kind, law,
         moving ? "facet with full tangent" : "facet with fixed tangent", scene,
         repeats);
  }
}

void time_tools(const Kind& kind, const Law& law, int repeats)
{
  for (const std::string name :
       {"plane", "sphere", "turned plane", "free plane"})
  {
    Scene scene(kind, law);
    scene.meet(tool_of(name, scene.state.slave.gdim));
    time(kind, law, name, scene, repeats);
  }
}
} // namespace
} // namespace raymortar::test

int main(int argc, char** argv)
{
  using namespace raymortar::test;
  const int repeats = argc > 1 ? std::atoi(argv[1]) : 5;
  std::puts("shape,degree,law,target,residual,tangent");
  for (const Kind& kind : kinds)
    for (const Law& law : laws)
    {
      time_pairs(kind, law, repeats);
      time_tools(kind, law, repeats);
    }
}
