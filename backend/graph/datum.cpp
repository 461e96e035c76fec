// Connected parts of a graph, and what holds each in space.
#include <lamina/backend/graph/datum.hpp>

namespace lamina {
namespace {

std::size_t count_of(const Graph& graph) {
  return graph.keyframes.size() + graph.planes.size() + graph.surfels.size() +
         graph.custom_states.size();
}

/// Union-find over keyframes, planes, surfels and custom states.
class Parts {
 public:
  explicit Parts(const Graph& graph) : graph_(graph), parent_(count_of(graph)) {
    for (std::size_t i = 0; i < parent_.size(); ++i) parent_[i] = i;
  }
  std::size_t node(KeyframeId id) const {
    return static_cast<std::size_t>(&graph_.at(id) - graph_.keyframes.data());
  }
  std::size_t node(PlaneId id) const {
    return graph_.keyframes.size() +
           static_cast<std::size_t>(&graph_.at(id) - graph_.planes.data());
  }
  std::size_t node(SurfelId id) const {
    return graph_.keyframes.size() + graph_.planes.size() +
           static_cast<std::size_t>(&graph_.at(id) - graph_.surfels.data());
  }
  std::size_t node(CustomStateId id) const {
    return graph_.keyframes.size() + graph_.planes.size() + graph_.surfels.size() +
           static_cast<std::size_t>(&graph_.at(id) - graph_.custom_states.data());
  }
  std::size_t root(std::size_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  template <class A, class B>
  void join(A a, B b) {
    const std::size_t i = root(node(a)), j = root(node(b));
    parent_[std::max(i, j)] = std::min(i, j);  // the first keyframe of a part is its root
  }

 private:
  const Graph& graph_;
  std::vector<std::size_t> parent_;
};

}  // namespace

std::vector<KeyframeId> keyframes_without_datum(const Graph& graph) {
  Parts parts(graph);
  for (const auto& f : graph.odometry) parts.join(f.from, f.to);
  for (const auto& f : graph.planar_odometry) parts.join(f.from, f.to);
  for (const auto& f : graph.loops) parts.join(f.from, f.to);
  for (const auto& f : graph.plane_moments) parts.join(f.keyframe, f.plane);
  for (const auto& f : graph.segments) parts.join(f.keyframe, f.plane);
  for (const auto& s : graph.surfels) parts.join(s.anchor, s.id);
  for (const auto& f : graph.surfel_moments) parts.join(f.keyframe, f.surfel);
  for (const auto& f : graph.surfel_parents) parts.join(f.surfel, f.plane);
  for (const auto& f : graph.custom) {
    for (const StateRef& state : f.states) {
      std::visit([&](auto a) { std::visit([&](auto b) { parts.join(a, b); }, f.states[0]); },
                 state);
    }
  }
  std::vector<bool> has_datum(count_of(graph), false);
  for (const auto& k : graph.keyframes) {
    if (k.fixed) has_datum[parts.root(parts.node(k.id))] = true;
  }
  for (const auto& f : graph.priors) has_datum[parts.root(parts.node(f.keyframe))] = true;
  for (const auto& prior : graph.marginal_priors) {
    for (const auto id : prior.keyframes) has_datum[parts.root(parts.node(id))] = true;
  }
  std::vector<KeyframeId> found;
  for (const auto& k : graph.keyframes) {
    const std::size_t root = parts.root(parts.node(k.id));
    if (has_datum[root]) continue;
    has_datum[root] = true;
    found.push_back(k.id);
  }
  return found;
}

}  // namespace lamina
