#include "bind.h"
#include "raymortar/fem/zone.h"
#include "raymortar/flux/flux.h"
#include "structs.h"

namespace raymortar::bindings
{
namespace
{
/// A field on both sides: values and rows, (facets, nodes per facet)
struct BoundFields
{
  std::vector<double> slave, master;
  std::vector<GlobalIndex> slave_rows, master_rows;
  int slave_degree = 1, master_degree = 1;
  double tool = 0.0;

  [[nodiscard]] FluxFields fields() const
  {
    return {{slave_degree, slave, slave_rows},
            {master_degree, master, master_rows},
            tool};
  }
};

py::dict points_of_flux(const Zone& z, const BoundFields& f)
{
  const FluxPoints p = flux_points(z.state(), f.fields());
  const IntegrationPoints& all = z.state().points;
  std::vector<Index> facet;
  std::vector<Vec<2>> xi;
  for (const Index q : p.point)
  {
    facet.push_back(all.slave[static_cast<std::size_t>(q)]);
    xi.push_back(all.xi[static_cast<std::size_t>(q)]);
  }
  py::dict out;
  out["point"] = to_array(p.point);
  out["facet"] = to_array(facet);
  out["xi"] = points_to_array(xi, z.state().slave.gdim - 1);
  out["slave"] = to_array(p.slave);
  out["target"] = to_array(p.target);
  out["pressure"] = to_array(p.pressure);
  out["gap"] = to_array(p.gap);
  out["slip"] = to_array(p.slip);
  out["work"] = to_array(p.work);
  out["weight"] = to_array(p.weight);
  return out;
}

FluxValues values(const Array<double>& q, double slave_heat, double target_heat)
{
  FluxValues flux;
  flux.q = to_span(q);
  flux.slave_heat = slave_heat;
  flux.target_heat = target_heat;
  return flux;
}
} // namespace

void bind_flux(py::module_& m)
{
  bind_options<BoundFields>(m, "FluxFields",
                            Field{"slave", &BoundFields::slave},
                            Field{"master", &BoundFields::master},
                            Field{"slave_rows", &BoundFields::slave_rows},
                            Field{"master_rows", &BoundFields::master_rows},
                            Field{"slave_degree", &BoundFields::slave_degree},
                            Field{"master_degree", &BoundFields::master_degree},
                            Field{"tool", &BoundFields::tool});
  m.def("flux_points", &points_of_flux);
  m.def("flux_residual",
        [](const Zone& z, const BoundFields& f, const Array<double>& q,
           double slave_heat, double target_heat)
        {
          const auto out = flux_residual(z.state(), f.fields(),
                                         values(q, slave_heat, target_heat));
          return py::make_tuple(to_array(out.rows), to_array(out.values));
        });
  m.def("flux_tangent",
        [](const Zone& z, const BoundFields& f, const Array<double>& q,
           double slave_heat, double target_heat, const Array<double>& slopes,
           const Array<double>& along)
        {
          FluxValues flux = values(q, slave_heat, target_heat);
          flux.slopes = to_span(slopes);
          flux.along = to_span(along);
          const auto out = flux_tangent(z.state(), f.fields(), flux);
          return py::make_tuple(to_array(out.rows), to_array(out.columns),
                                to_array(out.values));
        });
  m.def("to_master_facets",
        [](const Zone& z, const Array<double>& owned, int width)
        { return to_array(z.to_master_facets(to_span(owned), width)); });
  m.def("rows_of_master_facets",
        [](const Zone& z, const Array<GlobalIndex>& owned, int width)
        { return to_array(z.to_master_facets(to_span(owned), width)); });
}
} // namespace raymortar::bindings
