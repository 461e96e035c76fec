// A* by Boost.Graph over cells that the robot fits on.
#include <lamina/grid/planner.hpp>

#include <algorithm>
#include <boost/graph/astar_search.hpp>
#include <boost/property_map/function_property_map.hpp>
#include <cmath>
#include <cstdio>
#include <limits>

#include <lamina/grid/robot_graph.hpp>
#include <lamina/models/error.hpp>

namespace lamina {
namespace {

struct Arrived {};
class StopAtGoal : public boost::default_astar_visitor {
 public:
  explicit StopAtGoal(RobotGraph::Vertex goal) : goal_(goal) {}
  template <class Graph>
  void examine_vertex(RobotGraph::Vertex v, const Graph&) const {
    if (v == goal_) throw Arrived{};
  }

 private:
  RobotGraph::Vertex goal_;
};

std::string at_place(const Eigen::Vector2d& p) {
  char text[64];
  std::snprintf(text, sizeof text, "%.2f, %.2f", p.x(), p.y());
  return text;
}

std::string why_not_free(const NavigabilityGrid& grid, const Eigen::Vector2d& p, const char* what,
                         double radius) {
  const NavigabilityCell* cell = grid.find(cell_of(p, grid.resolution()));
  const std::string name = std::string(what) + " (" + at_place(p) + ")";
  if (cell == nullptr || !cell->known()) return name + " is unknown: the map has not seen it";
  if (!(cell->navigability > 0)) return name + " is not free: navigability is 0 there";
  char text[96];
  std::snprintf(text, sizeof text, " is not free: less than %.2f m from what is blocked or unknown",
                radius);
  return name + text;
}

// The start, or the nearest place to it where it was never seen.
std::optional<CellIndex> start_cell(const NavigabilityGrid& grid, const RobotGraph& graph,
                                    const Eigen::Vector2d& from, double reach) {
  const double r = grid.resolution();
  const CellIndex home = cell_of(from, r);
  if (graph.fits(home)) return home;
  const NavigabilityCell* cell = grid.find(home);
  if (cell != nullptr && cell->known() && !(cell->navigability > 0)) return std::nullopt;
  const int n = static_cast<int>(reach / r);
  std::optional<CellIndex> best;
  double nearest = reach;
  for (int dj = -n; dj <= n; ++dj) {
    for (int di = -n; di <= n; ++di) {
      const CellIndex c{home.i + di, home.j + dj};
      const double d = (center_of(c, r) - from).norm();
      if (d >= nearest || !graph.fits(c)) continue;
      nearest = d;
      best = c;
    }
  }
  return best;
}

struct Search {
  std::vector<double> distance, rank;
  std::vector<RobotGraph::Vertex> parent;
  bool arrived = false;
};

Search search(const RobotGraph& graph, RobotGraph::Vertex start, RobotGraph::Vertex goal) {
  const double inf = std::numeric_limits<double>::infinity();
  Search s;
  s.distance.assign(graph.size(), inf);
  s.rank.assign(graph.size(), inf);
  s.parent.assign(graph.size(), -1);
  std::vector<boost::default_color_type> color(graph.size(), boost::white_color);
  const Eigen::Vector2d end = graph.position(goal);
  const auto ahead = [&](RobotGraph::Vertex v) { return (graph.position(v) - end).norm(); };
  const auto index = boost::typed_identity_property_map<RobotGraph::Vertex>();
  const auto map = [&index](auto& values) {
    return boost::make_iterator_property_map(values.begin(), index);
  };
  s.distance[static_cast<std::size_t>(start)] = 0;
  s.rank[static_cast<std::size_t>(start)] = ahead(start);
  s.parent[static_cast<std::size_t>(start)] = start;
  const auto weight = boost::make_function_property_map<RobotGraph::Edge>(
      [&graph](const RobotGraph::Edge& e) { return graph.cost(e); });
  try {
    boost::astar_search_no_init(graph, start, ahead, StopAtGoal(goal), map(s.parent), map(s.rank),
                                map(s.distance), weight, map(color), index, std::less<double>(),
                                std::plus<double>(), inf, 0.0);
  } catch (const Arrived&) {
    s.arrived = true;
  }
  return s;
}

Plan no_way(const RobotGraph& graph, const Search& s, const Eigen::Vector2d& to) {
  Plan plan;
  plan.status = PlanStatus::kNoWay;
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t v = 0; v < graph.size(); ++v) {
    if (!std::isfinite(s.distance[v])) continue;
    const Eigen::Vector2d p = graph.position(static_cast<RobotGraph::Vertex>(v));
    const double d = (p - to).norm();
    if (d >= nearest) continue;
    nearest = d;
    plan.nearest_map = p;
  }
  char text[64];
  std::snprintf(text, sizeof text, "%.2f m", nearest);
  plan.reason = "no way: what can be reached from the start ends at " +
                at_place(*plan.nearest_map) + ", " + text + " from the goal";
  return plan;
}

Plan stopped(PlanStatus status, std::string reason) {
  Plan plan;
  plan.status = status;
  plan.reason = std::move(reason);
  return plan;
}

}  // namespace

std::vector<std::string> PlannerOptions::problems() const {
  std::vector<std::string> found;
  if (!(robot_radius >= 0)) found.emplace_back("robot_radius must not be negative");
  if (!(max_step > 0)) found.emplace_back("max_step must be above 0");
  if (!(comfort >= 0)) found.emplace_back("comfort must not be negative");
  if (!(clear_weight >= 0)) found.emplace_back("clear_weight must not be negative");
  if (!(level_weight >= 0)) found.emplace_back("level_weight must not be negative");
  if (!(start_reach >= 0)) found.emplace_back("start_reach must not be negative");
  return found;
}

Plan plan_path(const NavigabilityGrid& grid, const Eigen::Vector2d& from, const Eigen::Vector2d& to,
               const PlannerOptions& options) {
  if (const auto wrong = options.problems(); !wrong.empty()) throw Error(wrong.front());
  const RobotGraph graph(grid, known_bounds(grid), options);
  const std::optional<CellIndex> first = start_cell(grid, graph, from, options.start_reach);
  if (!first) {
    return stopped(PlanStatus::kStartNotFree,
                   why_not_free(grid, from, "start", options.robot_radius));
  }
  const CellIndex last = cell_of(to, grid.resolution());
  if (!graph.fits(last)) {
    return stopped(PlanStatus::kGoalNotFree, why_not_free(grid, to, "goal", options.robot_radius));
  }
  const Search s = search(graph, graph.vertex(*first), graph.vertex(last));
  if (!s.arrived) return no_way(graph, s, to);
  Plan plan;
  plan.status = PlanStatus::kFound;
  plan.path_map.push_back(to);
  for (RobotGraph::Vertex v = graph.vertex(last);; v = s.parent[static_cast<std::size_t>(v)]) {
    plan.path_map.push_back(graph.position(v));
    if (v == graph.vertex(*first)) break;
  }
  plan.path_map.push_back(from);
  std::reverse(plan.path_map.begin(), plan.path_map.end());
  for (std::size_t k = 1; k < plan.path_map.size(); ++k) {
    plan.length += (plan.path_map[k] - plan.path_map[k - 1]).norm();
  }
  return plan;
}

}  // namespace lamina
