// Kernels for facets of any kinds against those of one kind, on the same state.
#include "raymortar/element/general_assembler.h"
#include "rules.h"
#include "surfaces.h"
#include <gtest/gtest.h>
#include <typeinfo>

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
    m.degree = kind.shape == Shape::interval ? kind.degree : 1;
    m.components = kind.components == 1 ? 1 : s.slave.gdim;
    m.scale = 3.0;
    const Index per_facet =
        m.degree == 2 ? s.slave.dofs_per_facet() : s.slave.corners();
    for (Index k = 0; k < per_facet * s.slave.num_facets(); ++k)
    {
      m.facet.push_back(k);
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

  Blocks() = default;
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

/// Minus the sum of tractions at points
std::vector<double> force_on_slave(const PointResults& r, int gdim)
{
  std::vector<double> force(static_cast<std::size_t>(gdim), 0.0);
  for (std::size_t q = 0; q < r.weight.size(); ++q)
    for (std::size_t i = 0; i < force.size(); ++i)
      force[i] -= r.weight[q] * r.traction[q * force.size() + i];
  return force;
}

/// Sum of the residual over the slave's displacements
std::vector<double> force_on_slave(const Assembler& kernel,
                                   const ContactState& s)
{
  const auto gdim = static_cast<std::size_t>(s.slave.gdim);
  const auto dofs = static_cast<std::size_t>(s.slave.dofs_per_facet());
  std::vector<double> force(gdim, 0.0);
  kernel.residual(s,
                  [&](std::size_t, const double* b, int)
                  {
                    for (std::size_t k = 0; k < gdim * dofs; ++k)
                      force[k % gdim] += b[k];
                  });
  return force;
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
  const Assembler &typed = *one, &general = *any;
  ASSERT_NE(typeid(typed), typeid(general));
  const Blocks a(typed, s), b(general, s);
  ASSERT_FALSE(a.tangent.empty());
  expect_equal(a.residual, b.residual);
  expect_equal(a.tangent, b.tangent);
  expect_equal(a.couplings, b.couplings);
  expect_equal(force_on_slave(general.results(s), s.slave.gdim),
               force_on_slave(typed, s));
}

/// Those that have a kernel of their own
void add_kinds(Shape shape, int degree, Measure measure, std::vector<Kind>& all)
{
  const auto augmented = Method::augmented_lagrangian;
  const auto add = [&](Method method, bool has_friction, int components)
  {
    for (const bool has_fields : {true, false})
      all.push_back({shape, degree, degree, method, has_friction, components,
                     measure, has_fields});
  };
  add(augmented, false, 1);
  add(Method::penalty, false, 0);
  if (degree == 2 and shape != Shape::interval)
    return;
  add(augmented, true, 3);
  add(Method::penalty, true, 0);
}

std::vector<Kind> kinds()
{
  std::vector<Kind> all;
  for (const Shape shape :
       {Shape::interval, Shape::triangle, Shape::quadrilateral})
    for (const int degree : {1, 2})
    {
      const auto measure = degree == 1 ? Measure::current : Measure::reference;
      add_kinds(shape, degree, measure, all);
      if (shape == Shape::interval)
        for (const auto turned :
             {Measure::reference_of_revolution, Measure::current_of_revolution})
          add_kinds(shape, degree, turned, all);
    }
  return all;
}

INSTANTIATE_TEST_SUITE_P(All, GeneralKernels, testing::ValuesIn(kinds()));

namespace
{
/// Quadratic functions' nodal values of linear ones, (nodes, corners)
Eigen::MatrixXd elevation(Shape shape)
{
  return with_shape(shape,
                    []<Shape S>() -> Eigen::MatrixXd
                    {
                      using Linear = Lagrange<S, 1>;
                      using Quadratic = Lagrange<S, 2>;
                      Mat<Quadratic::nodes, Linear::nodes> P;
                      for (int a = 0; a < Quadratic::nodes; ++a)
                        P.row(a) = Linear::values(Vec<Reference<S>::tdim>(
                            Quadratic::points[std::size_t(a)].data()));
                      return P;
                    });
}

/// The same for each of some components of node after node
Eigen::MatrixXd by_component(const Eigen::MatrixXd& P, int components)
{
  Eigen::MatrixXd all =
      Eigen::MatrixXd::Zero(P.rows() * components, P.cols() * components);
  for (Eigen::Index a = 0; a < P.rows(); ++a)
    for (Eigen::Index c = 0; c < P.cols(); ++c)
      all.block(a * components, c * components, components, components)
          .diagonal()
          .setConstant(P(a, c));
  return all;
}

/// Values at quadratic nodes of a field on facets
void elevate(const Eigen::MatrixXd& P, int width, std::vector<double>& nodal)
{
  const Eigen::MatrixXd by = by_component(P, width);
  std::vector<double> out;
  for (std::size_t k = 0; k < nodal.size();
       k += static_cast<std::size_t>(by.cols()))
  {
    const Eigen::VectorXd of_facet =
        by * Eigen::Map<const Eigen::VectorXd>(nodal.data() + k, by.cols());
    out.insert(out.end(), of_facet.begin(), of_facet.end());
  }
  nodal = out;
}

/// Of linear displacements on quadratic positions, as quadratic displacements
ContactState elevated(ContactState s)
{
  const Eigen::MatrixXd P = elevation(s.slave.shape);
  for (FacetField* field : {&s.gamma, &s.offset, &s.friction_coefficient})
    elevate(P, 1, field->nodal);
  elevate(P, s.slave.gdim, s.traction_old.nodal);
  for (Surface* side : {&s.slave, &s.master})
  {
    side->degree = 2;
    side->facet_dofs = side->facet_nodes;
  }
  return s;
}

/// Blocks of quadratic displacements in the unknowns of linear ones
class Restriction
{
public:
  explicit Restriction(const ContactState& s)
      : _side(by_component(elevation(s.slave.shape), s.slave.gdim)),
        _multipliers(static_cast<Eigen::Index>(
                         s.multipliers.per_facet(s.slave.num_facets())) *
                     s.multipliers.components)
  {
  }

  [[nodiscard]] Blocks blocks(const Assembler& assembler,
                              const ContactState& s) const
  {
    Blocks out;
    assembler.residual(
        s, [&](std::size_t, const double* b, int n)
        { append(of(n).transpose() * block(b, n, 1), out.residual); });
    std::vector<std::size_t> all(s.elements.size());
    std::iota(all.begin(), all.end(), std::size_t(0));
    const auto restricted = [&](const double* A, int n) -> Eigen::MatrixXd
    { return of(n).transpose() * block(A, n, n) * of(n); };
    assembler.tangent(
        s, all,
        [&](std::size_t, const double* A, int n)
        { append(restricted(A, n), out.tangent); },
        [&](std::size_t, Index, const double* A, int n, const double* rows)
        {
          append(restricted(A, n), out.couplings);
          const auto m = static_cast<int>(_side.rows());
          if (rows)
            append(_side.transpose() * block(rows, m, m) * _side,
                   out.couplings);
        });
    return out;
  }

private:
  using Rows =
      Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  /// [slave | multiplier | master], or without a master
  [[nodiscard]] Eigen::MatrixXd of(int size) const
  {
    const Eigen::Index alone = _side.rows() + _multipliers;
    const bool has_master = size > alone;
    const Eigen::Index columns = _side.cols() + _multipliers;
    Eigen::MatrixXd P =
        Eigen::MatrixXd::Zero(size, columns + (has_master ? _side.cols() : 0));
    P.topLeftCorner(_side.rows(), _side.cols()) = _side;
    P.block(_side.rows(), _side.cols(), _multipliers, _multipliers)
        .setIdentity();
    if (has_master)
      P.bottomRightCorner(_side.rows(), _side.cols()) = _side;
    return P;
  }

  [[nodiscard]] static Rows block(const double* values, int rows, int columns)
  {
    return Eigen::Map<const Rows>(values, rows, columns);
  }

  static void append(const Rows& block, std::vector<double>& out)
  {
    out.insert(out.end(), block.data(), block.data() + block.size());
  }

  Eigen::MatrixXd _side;
  Eigen::Index _multipliers;
};
} // namespace

class RareKernels : public testing::TestWithParam<Kind>
{
};

/// Quadratic positions and linear displacements are quadratic ones whose mid
/// nodes move by the mean
TEST_P(RareKernels, OfLinearDisplacementsAreThoseOfQuadraticOnes)
{
  const StateOf of(GetParam());
  const ContactState two = elevated(of.state);
  const Blocks a(*make_assembler(of.state), of.state);
  const Blocks b = Restriction(of.state).blocks(*make_assembler(two), two);
  ASSERT_FALSE(a.tangent.empty());
  expect_equal(a.residual, b.residual);
  expect_equal(a.tangent, b.tangent);
  expect_equal(a.couplings, b.couplings);
}

/// A vector without friction is one whose friction has the coefficient zero
TEST_P(RareKernels, OfVectorsWithoutFrictionAreThoseOfNone)
{
  Kind kind = GetParam();
  kind.method = Method::augmented_lagrangian;
  kind.has_friction = kind.has_fields = false;
  kind.components = 3;
  StateOf of(kind);
  const Blocks a(*make_assembler(of.state), of.state);
  of.state.friction = Coulomb{0.0};
  const Blocks b(*make_assembler(of.state), of.state);
  expect_equal(a.residual, b.residual);
  expect_equal(a.tangent, b.tangent);
  expect_equal(a.couplings, b.couplings);
}

std::vector<Kind> rare_kinds()
{
  std::vector<Kind> all;
  for (const Shape shape :
       {Shape::interval, Shape::triangle, Shape::quadrilateral})
    for (const auto measure : {Measure::reference, Measure::current})
    {
      const auto augmented = Method::augmented_lagrangian;
      all.push_back({shape, 1, 2, augmented, false, 1, measure});
      all.push_back({shape, 1, 2, augmented, true, 3, measure});
      all.push_back({shape, 1, 2, Method::penalty, false, 0, measure});
      all.push_back({shape, 1, 2, Method::penalty, true, 0, measure});
    }
  return all;
}

INSTANTIATE_TEST_SUITE_P(All, RareKernels, testing::ValuesIn(rare_kinds()));
} // namespace raymortar::test
