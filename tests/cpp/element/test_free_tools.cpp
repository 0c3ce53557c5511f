// Columns of a free tool's unknowns against differences of the residual.
#include "raymortar/element/assembler.h"
#include "raymortar/element/free_tools.h"
#include "raymortar/mortar/tool_rays.h"
#include "raymortar/mortar/whole_facets.h"
#include "raymortar/rigid/facet_tool.h"
#include "raymortar/rigid/shapes.h"
#include "rules.h"
#include "surfaces.h"
#include <Eigen/Geometry>
#include <gtest/gtest.h>

namespace raymortar::test
{
namespace
{
const Vec<3> middle_of_ball(0.1, 0.05, -0.9);

Mat<3, 3> cross(int axis)
{
  Mat<3, 3> m;
  const Vec<3> e = Vec<3>::Unit(axis);
  m << 0.0, -e[2], e[1], e[2], 0.0, -e[0], -e[1], e[0], 0.0;
  return m;
}

/// Translations and turns, with their derivatives near no turn at all: to the
/// first order in theta
Freedom freedom_at(const std::vector<int>& axes, const std::vector<int>& turns,
                   const Vec<3>& place, const Vec<3>& theta)
{
  Freedom f;
  f.centre = place;
  for (const int axis : axes)
    f.rates.push_back({Vec<3>::Unit(axis), Mat<3, 3>::Zero()});
  for (const int j : turns)
  {
    Mat<3, 3> spin = cross(j);
    for (const int k : turns)
      spin += 0.5 * theta[k] * (cross(k) * cross(j) - cross(j) * cross(k));
    f.rates.push_back({Vec<3>::Zero(), spin});
  }
  const auto n = static_cast<std::size_t>(f.size());
  f.bends.assign(n * n, Mat<3, 3>::Zero());
  for (std::size_t j = axes.size(); j < n; ++j)
    for (std::size_t k = axes.size(); k < n; ++k)
    {
      const int a = turns[j - axes.size()], b = turns[k - axes.size()];
      f.bends[j * n + k] = 0.5 * (cross(a) * cross(b) + cross(b) * cross(a));
    }
  f.rows.assign(n, 0);
  return f;
}

struct Scene
{
  Shape shape;
  int degree;
  bool has_friction;
  bool is_flat = false;
  double coat = 0.0; ///< its frame is the tool's where there is one
};

class FreeTools : public testing::TestWithParam<Scene>
{
protected:
  FreeTools()
  {
    const Shape shape = GetParam().shape;
    const int degree = GetParam().degree;
    s.slave = make_surface({shape, degree, degree, 3, false},
                           graph(0.5, [](double x, double y)
                                 { return 0.02 * std::sin(3.0 * x + y); }));
    s.master.gdim = s.slave.gdim;
    s.method = Method::penalty;
    s.gamma.nodal.assign(s.slave.facet_dofs.size(), 7.0);
    if (GetParam().coat > 0.0)
    {
      s.frame = LawFrame::master;
      s.offset.nodal.assign(s.slave.facet_dofs.size(), -GetParam().coat);
    }
    if (GetParam().has_friction)
      s.friction = Coulomb{0.3};
    s.segmentation = whole_facets(s.slave);
    s.points = make_points(s.slave, s.segmentation, segment_rules(shape, 4),
                           rule_on(shape, 4), false);
    axes = s.slave.gdim == 2 ? std::vector{0, 1} : std::vector{0, 1, 2};
    turns = s.slave.gdim == 2 ? std::vector{2} : std::vector{0, 1, 2};
    if (s.slave.gdim == 2)
      middle = {middle_of_ball[0], middle_of_ball[2], 0.0};
    const Vec<3> up = Vec<3>::Unit(s.slave.gdim - 1);
    tool = GetParam().is_flat ? make_plane(0.03 * up, up)
                              : make_sphere(middle, 0.95, {});
  }

  /// Put the tool where some unknowns say
  void move(const Eigen::VectorXd& q)
  {
    Vec<3> shift = Vec<3>::Zero(), theta = Vec<3>::Zero();
    for (std::size_t i = 0; i < axes.size(); ++i)
      shift[axes[i]] = q[static_cast<Eigen::Index>(i)];
    for (std::size_t i = 0; i < turns.size(); ++i)
      theta[turns[i]] = q[static_cast<Eigen::Index>(axes.size() + i)];
    const double angle = theta.norm();
    const Mat<3, 3> R =
        angle == 0.0
            ? Mat<3, 3>(Mat<3, 3>::Identity())
            : Eigen::AngleAxisd(angle, theta / angle).toRotationMatrix();
    const Vec<3> c = middle + beside;
    PlacedTool placed;
    placed.tool = with_freedom(tool, freedom_at(axes, turns, c + shift, theta));
    placed.now = {R, c + shift - R * c};
    // It has slid since the accepted step
    placed.old.shift = Vec<3>(0.004, -0.003, s.slave.gdim == 2 ? 0.0 : 0.001);
    s.tools = {placed};
    s.hits = cast_on_tools(s.slave, s.tools, s.points, {1.0, 1.0});
    s.elements = group_points(s.points, s.hits);
  }

  /// Blocks of elements one after the other: residuals
  [[nodiscard]] std::vector<double> residual() const
  {
    std::vector<double> all;
    make_assembler(s)->residual(s, [&](std::size_t, const double* b, int n)
                                { all.insert(all.end(), b, b + n); });
    return all;
  }

  ContactState s;
  std::vector<int> axes, turns;
  Vec<3> middle = middle_of_ball, beside = Vec<3>(0.1, -0.2, 0.0);
  std::shared_ptr<const Tool> tool;
};

TEST_P(FreeTools, HaveColumnsThatAreDerivatives)
{
  const auto n = static_cast<Eigen::Index>(axes.size() + turns.size());
  constexpr double h = 1e-6; // slip changes its way over lengths of 1e-3
  std::vector<std::vector<double>> differences;
  for (Eigen::Index j = 0; j < n; ++j)
  {
    const Eigen::VectorXd step = h * Eigen::VectorXd::Unit(n, j);
    move(step);
    std::vector<double> ahead = residual();
    move(-step);
    const std::vector<double> behind = residual();
    ASSERT_EQ(ahead.size(), behind.size());
    for (std::size_t i = 0; i < ahead.size(); ++i)
      ahead[i] = (ahead[i] - behind[i]) / (2.0 * h);
    differences.push_back(std::move(ahead));
  }
  move(Eigen::VectorXd::Zero(n));
  std::vector<std::size_t> every(s.elements.size());
  std::iota(every.begin(), every.end(), std::size_t(0));
  std::size_t begin = 0;
  double largest = 0.0;
  int free_elements = 0;
  make_assembler(s)->tangent(
      s, every,
      [&](std::size_t e, const double* A, int size)
      {
        const bool is_free = free_tool_of(s, e) != no_index;
        free_elements += is_free ? 1 : 0;
        for (int i = 0; is_free and i < size; ++i)
          for (Eigen::Index j = 0; j < n; ++j)
          {
            const double found = A[i * size + (size - n) + j];
            const double expected =
                differences[static_cast<std::size_t>(j)]
                           [begin + static_cast<std::size_t>(i)];
            largest = std::max(largest, std::abs(expected));
            EXPECT_NEAR(found, expected, 2e-8) << i << " " << j;
          }
        begin += static_cast<std::size_t>(size);
      },
      [](std::size_t, Index, const double*, int, const double*) {});
  EXPECT_GT(free_elements, 2);
  EXPECT_GT(largest, 0.05);
}

TEST_P(FreeTools, AreHeldWithoutUnknowns)
{
  const auto free = with_freedom(tool, freedom_at(axes, turns, middle, {}));
  EXPECT_NE(freedom_of(PlacedTool{free, {}, {}}), nullptr);
  EXPECT_EQ(with_freedom(free, {}), tool);
  EXPECT_EQ(freedom_of(PlacedTool{tool, {}, {}}), nullptr);
}

INSTANTIATE_TEST_SUITE_P(
    Scenes, FreeTools,
    testing::Values(Scene{Shape::interval, 1, false},
                    Scene{Shape::interval, 2, true},
                    Scene{Shape::triangle, 1, true},
                    Scene{Shape::quadrilateral, 2, true},
                    Scene{Shape::interval, 1, true, true},
                    Scene{Shape::triangle, 1, false, true},
                    Scene{Shape::triangle, 2, true, true},
                    Scene{Shape::interval, 1, true, true, 0.05},
                    Scene{Shape::interval, 2, false, false, 0.05},
                    Scene{Shape::triangle, 2, true, false, 0.05},
                    Scene{Shape::quadrilateral, 1, false, true, 0.05}));
} // namespace
} // namespace raymortar::test
