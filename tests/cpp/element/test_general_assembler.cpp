// Kernels for facets of any kinds against those of one kind, on the same state.
#include "raymortar/element/general_assembler.h"
#include "rules.h"
#include "surfaces.h"
#include <gtest/gtest.h>

namespace raymortar::test
{
namespace
{
struct Kind
{
  Shape shape;
  int degree, node_degree;
  Method method;
  bool has_friction;
  int components;
  Measure measure;
  bool has_fields = true; ///< else one gamma, no offset, springs or coefficient
};

/// Two bent surfaces close to each other with random fields and tractions
class StateOf
{
public:
  explicit StateOf(const Kind& kind) : _random(7)
  {
    const auto wave = [](double x, double y)
    { return 0.03 * std::sin(2.0 * x + 0.3) - 0.02 * x * y; };
    state.slave = surface(
        kind, 2, false,
        graph(0.8, [&](double x, double y) { return wave(x, y) + 0.004; }));
    state.master = surface(kind, 3, true, graph(1.1, wave));
    if (revolves(kind.measure)) // off the axis
      for (Surface* s : {&state.slave, &state.master})
        transform<2>(*s,
                     [](const Vec<2>& x) { return Vec<2>(x[0] + 1.2, x[1]); });
    // The accepted step is another place
    for (Surface* s : {&state.slave, &state.master})
      for (double& x : s->x)
        x += number(0.01);
    set_fields(kind);
    pair(kind);
  }

  ContactState state;

private:
  static Surface surface(const Kind& kind, int n, bool up, const Map& map)
  {
    return make_surface({kind.shape, kind.degree, kind.node_degree, n, up},
                        map);
  }

  double number(double size)
  {
    return std::uniform_real_distribution<double>(-size, size)(_random);
  }

  void set_fields(const Kind& kind)
  {
    ContactState& s = state;
    const auto d = static_cast<std::size_t>(s.slave.gdim);
    const std::size_t dofs = s.slave.facet_dofs.size();
    if (not kind.has_fields)
      s.gamma.nodal.assign(dofs, 5.0);
    for (std::size_t k = 0; kind.has_fields and k < dofs; ++k)
    {
      s.gamma.nodal.push_back(5.0 + number(1.0));
      s.offset.nodal.push_back(number(0.002));
      s.friction_coefficient.nodal.push_back(0.4 + number(0.1));
      for (std::size_t i = 0; i < d; ++i)
        s.traction_old.nodal.push_back(number(0.01));
    }
    s.measure = kind.measure;
    s.moving_segments = true;
    s.method = kind.method;
    if (kind.has_friction)
      s.friction = Coulomb{0.3};
    if (kind.components == 0)
      return;
    Multipliers& m = s.multipliers;
    m.degree = 1;
    m.components = kind.components == 1 ? 1 : s.slave.gdim;
    m.scale = 3.0;
    const auto corners = static_cast<std::size_t>(s.slave.corners());
    for (std::size_t k = 0;
         k < corners * static_cast<std::size_t>(s.slave.num_facets()); ++k)
    {
      m.facet.push_back(static_cast<Index>(k));
      m.row.push_back(0);
      for (int i = 0; i < m.components; ++i)
        m.value.push_back(m.components == 1 ? -0.2 + number(0.1) : number(0.2));
    }
  }

  void pair(const Kind& kind)
  {
    ContactState& s = state;
    const FacetDistances distances(0.5, 0.5);
    const SegmentationOptions options(distances, false);
    s.segmentation = segments_of(s.slave, s.master, options);
    s.segment_rules = segment_rules(kind.shape, 4);
    s.points = make_points(s.slave, s.segmentation, s.segment_rules,
                           rule_on(kind.shape, 4), s.multipliers.components > 0,
                           revolves(s.measure));
    s.hits = cast_rays(s.slave, s.master, s.points, distances);
    s.elements = group_points(s.points, s.hits);
  }

  std::mt19937 _random;
};

/// All blocks one after the other
struct Blocks
{
  std::vector<double> residual, tangent, couplings;

  Blocks(const Assembler& assembler, const ContactState& s)
  {
    assembler.residual(s, [&](std::size_t, const double* b, int n)
                       { residual.insert(residual.end(), b, b + n); });
    std::vector<std::size_t> all(s.elements.size());
    std::iota(all.begin(), all.end(), std::size_t(0));
    assembler.tangent(
        s, all,
        [&](std::size_t, const double* A, int n)
        { tangent.insert(tangent.end(), A, A + n * n); },
        [&](std::size_t, Index, const double* A, int n, const double* rows)
        {
          couplings.insert(couplings.end(), A, A + n * n);
          const int m = s.slave.gdim * s.master.dofs_per_facet();
          if (rows)
            couplings.insert(couplings.end(), rows, rows + m * m);
        });
  }
};

void expect_equal(const std::vector<double>& a, const std::vector<double>& b)
{
  ASSERT_EQ(a.size(), b.size());
  double largest = 0.0;
  for (const double x : a)
    largest = std::max(largest, std::abs(x));
  for (std::size_t k = 0; k < a.size(); ++k)
    ASSERT_NEAR(a[k], b[k], 1e-13 * largest) << k;
}
} // namespace

class GeneralKernels : public testing::TestWithParam<Kind>
{
};

TEST_P(GeneralKernels, AreThoseOfOneKind)
{
  const StateOf of(GetParam());
  const ContactState& s = of.state;
  const auto one = make_assembler(s);
  const auto any = make_general_assembler(s);
  const Blocks a(*one, s), b(*any, s);
  ASSERT_FALSE(a.tangent.empty());
  expect_equal(a.residual, b.residual);
  expect_equal(a.tangent, b.tangent);
  expect_equal(a.couplings, b.couplings);
  const PointResults r = one->results(s), q = any->results(s);
  EXPECT_EQ(r.status, q.status);
  expect_equal(r.pressure, q.pressure);
  expect_equal(r.traction, q.traction);
  expect_equal(r.weight, q.weight);
  expect_equal(r.gamma, q.gamma);
  expect_equal(r.contact_normal, q.contact_normal);
  expect_equal(r.master_normal, q.master_normal);
  expect_equal(r.slip, q.slip);
  expect_equal(r.closing, q.closing);
  expect_equal(r.friction, q.friction);
}

void add_kinds(Shape shape, int p, int k, Measure measure,
               std::vector<Kind>& all)
{
  const auto augmented = Method::augmented_lagrangian;
  all.push_back({shape, p, k, augmented, false, 1, measure});
  all.push_back({shape, p, k, augmented, false, 3, measure});
  all.push_back({shape, p, k, augmented, true, 3, measure});
  all.push_back({shape, p, k, Method::penalty, false, 0, measure});
  all.push_back({shape, p, k, Method::penalty, true, 0, measure});
  all.push_back({shape, p, k, augmented, false, 1, measure, false});
  all.push_back({shape, p, k, augmented, true, 3, measure, false});
  all.push_back({shape, p, k, Method::penalty, true, 0, measure, false});
}

std::vector<Kind> kinds()
{
  std::vector<Kind> all;
  for (const Shape shape :
       {Shape::interval, Shape::triangle, Shape::quadrilateral})
    for (const auto& [p, k] : {std::pair{1, 1}, {1, 2}, {2, 2}})
    {
      const bool current = (p + k) % 2 == 0;
      const auto measure = current ? Measure::current : Measure::reference;
      add_kinds(shape, p, k, measure, all);
      if (shape == Shape::interval)
        for (const auto turned :
             {Measure::reference_of_revolution, Measure::current_of_revolution})
          add_kinds(shape, p, k, turned, all);
    }
  return all;
}

INSTANTIATE_TEST_SUITE_P(All, GeneralKernels, testing::ValuesIn(kinds()));
} // namespace raymortar::test
