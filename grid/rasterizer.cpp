// Tiles drawn, joined to floors, and judged.
#include <lamina/grid/rasterizer.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include <lamina/grid/raster_book.hpp>
#include <lamina/grid/raster_floor.hpp>
#include <lamina/models/error.hpp>

namespace lamina {

using namespace raster;

struct Rasterizer::State {
  RasterOptions options;
  Book book;
  NavigabilityGrid grid;
  float fallback = std::numeric_limits<float>::quiet_NaN();
  std::size_t drawn = 0;
  std::function<void()> before_each = [] {};
  bool floor_seen = false, floor_under_path = false;

  /// The best floor under a kept pose of the path.
  struct Leader {
    const Tile* tile = nullptr;  ///< nullptr: none
    std::int32_t component = -1;
  };
  std::vector<Leader> leaders;  ///< by seed
  std::vector<Tile*> in_order;  ///< all tiles, ascending by key
  bool were_few = false;        ///< led_by_few() the last time
  bool joined_anew = true;      ///< components, their links or the leaders are not what they were

  explicit State(const RasterOptions& o) : options(o), book(o), grid(o.resolution) {}
  Tile* tile_at(const TileKey& key, int di, int dj) const {
    const auto it = book.tiles.find({key.first + dj, key.second + di});
    return it == book.tiles.end() ? nullptr : it->second.get();
  }
  void draw(const PlanarMap& map);
  void draw(const PlanarMap& map, BandsOfPlanes& bands, Tile& tile, std::vector<TileKey>& linked);
  void link(const TileKey& key, Tile& tile);
  void lead(std::vector<std::int32_t>& asked);
  Leader leader(std::size_t seed) const;
  void reach();
  std::vector<Tile*> number_components(std::int32_t& count);
  std::vector<char> voted(Components& all, std::size_t count) const;
  bool led_by_few() const;
  void spread(const std::vector<Tile*>& floors, Components& all, const std::vector<char>& reached);
  void choose_again(Tile& tile);
  void judge();
  void around_changed(const std::vector<Tile*>& changed, int margin, void (State::*what)(Tile&));
  void look(Tile& tile);
  void judge(Tile& tile);
  Neighbourhood neighbourhood(const TileKey& key) const;
  void write(const CellIndex& c, const NavigabilityCell& cell);
};

// Steps of one update.
void Rasterizer::State::draw(const PlanarMap& map) {
  drawn = 0;
  BandsOfPlanes bands(options.resolution * kSide);
  std::vector<TileKey> linked;
  std::vector<std::int32_t> asked;  // seeds
  for (Tile* tile : book.marked) {
    before_each();
    if (tile->redraw) draw(map, bands, *tile, linked);
    if (!tile->reseed) continue;
    for (const Vote& vote : tile->votes) asked.push_back(vote.pose);
    find_seeds(book.seeds, options, *tile);
    asked.insert(asked.end(), tile->seeds.begin(), tile->seeds.end());
  }
  std::sort(linked.begin(), linked.end());
  linked.erase(std::unique(linked.begin(), linked.end()), linked.end());
  for (const TileKey& key : linked) {
    if (Tile* tile = tile_at(key, 0, 0)) link(key, *tile);
  }
  lead(asked);
}

void Rasterizer::State::draw(const PlanarMap& map, BandsOfPlanes& bands, Tile& tile,
                             std::vector<TileKey>& linked) {
  if (!tile.has_evidence() && tile.sites.empty()) return;
  const std::int32_t components = tile.components;
  const bool changed = draw_evidence(map, book.surfels_of, options, bands, tile);
  ++drawn;
  tile.rechoose = tile.rechoose || changed || !tile.has_evidence();
  if (!changed) return;
  tile.reseed = true;
  joined_anew = joined_anew || tile.components != components;
  const TileKey key = key_of(tile);
  linked.insert(linked.end(), {key, {key.first, key.second - 1}, {key.first - 1, key.second}});
}

Rasterizer::State::Leader Rasterizer::State::leader(std::size_t seed) const {
  Leader best;
  double score = std::numeric_limits<double>::infinity();
  book.at_seed(seed, [&](const Tile& tile) {
    const auto pose = static_cast<std::int32_t>(seed);
    const auto vote =
        std::lower_bound(tile.votes.begin(), tile.votes.end(), pose,
                         [](const Vote& v, std::int32_t wanted) { return v.pose < wanted; });
    if (vote == tile.votes.end() || vote->pose != pose || vote->score >= score) return;
    score = vote->score;
    best = {&tile, vote->component};
  });
  return best;
}

// Who leads where tiles voted again. One more that leads to where others lead is no news.
void Rasterizer::State::lead(std::vector<std::int32_t>& asked) {
  for (std::size_t k = book.seeds.size(); k < leaders.size(); ++k) {
    joined_anew = joined_anew || leaders[k].tile != nullptr;
  }
  leaders.resize(book.seeds.size());
  std::sort(asked.begin(), asked.end());
  asked.erase(std::unique(asked.begin(), asked.end()), asked.end());
  for (const std::int32_t pose : asked) {
    const auto k = static_cast<std::size_t>(pose);
    if (k >= leaders.size()) break;
    const Leader now = leader(k), was = leaders[k];
    leaders[k] = now;
    if (now.tile == was.tile && now.component == was.component) continue;
    const auto known = static_cast<std::size_t>(now.component);
    joined_anew = joined_anew || was.tile != nullptr || known >= now.tile->reached.size() ||
                  now.tile->reached[known] == 0;
  }
}

void Rasterizer::State::link(const TileKey& key, Tile& tile) {
  std::vector<Link> old;
  const auto join = [&](const Tile* other, std::vector<Link>& links, bool to_right) {
    old.swap(links);
    links.clear();
    if (other == nullptr) return;
    for (int k = 0; k < kSide; ++k) {
      const int a = to_right ? cell_in(kSide - 1, k) : cell_in(k, kSide - 1);
      const int b = to_right ? cell_in(0, k) : cell_in(k, 0);
      if (tile.cut(a) || other->cut(b)) continue;
      for (const Level& here : tile.levels_at(a)) {
        for (const Level& there : other->levels_at(b)) {
          if (!connects(here, there, options)) continue;
          const Link link{here.component, there.component};
          if (links.empty() || links.back().here != link.here || links.back().there != link.there) {
            links.push_back(link);
          }
        }
      }
    }
  };
  tile.right_tile = tile_at(key, 1, 0);
  tile.above_tile = tile_at(key, 0, 1);
  join(tile.right_tile, tile.right, true);
  joined_anew = joined_anew || old != tile.right;
  join(tile.above_tile, tile.above, false);
  joined_anew = joined_anew || old != tile.above;
}

// The components that are best under some pose of the path, by root.
std::vector<char> Rasterizer::State::voted(Components& all, std::size_t count) const {
  std::vector<char> reached(count, 0);
  for (const Leader& leader : leaders) {
    if (leader.tile == nullptr) continue;
    const std::int32_t component = leader.tile->first_component + leader.component;
    reached[static_cast<std::size_t>(all.root(component))] = 1;
  }
  return reached;
}

// Where most of the path has no floor under it, a camera is carried.
bool Rasterizer::State::led_by_few() const {
  const auto led = std::count_if(leaders.begin(), leaders.end(),
                                 [](const Leader& leader) { return leader.tile != nullptr; });
  return 2 * static_cast<std::size_t>(led) < leaders.size();
}

// Numbers the components of all tiles one after another; returns the tiles that have any.
std::vector<Tile*> Rasterizer::State::number_components(std::int32_t& count) {
  if (in_order.size() != book.tiles.size()) {  // tiles stay
    in_order.clear();
    for (const auto& [key, tile] : book.tiles) in_order.push_back(tile.get());
  }
  std::vector<Tile*> floors;
  count = 0;
  for (Tile* tile : in_order) {
    if (tile->components == 0) {
      tile->reached.clear();
      continue;
    }
    tile->first_component = count;
    count += tile->components;
    floors.push_back(tile);
  }
  return floors;
}

// Components of all tiles, joined over their borders; those under the path are the robot's floor.
// Where the path lies on no floor (a hand-held camera) it is the largest of all. Nothing changes
// while the graph of components and those who lead to it are the same, and are most of the path.
void Rasterizer::State::reach() {
  const bool few = led_by_few();
  if (!joined_anew && floor_under_path && !few && !were_few) return;
  were_few = few;
  joined_anew = false;
  std::int32_t count = 0;
  const std::vector<Tile*> floors = number_components(count);
  floor_seen = count > 0;
  Components all(static_cast<std::size_t>(count));
  for (const Tile* tile : floors) {
    const auto join = [&](const std::vector<Link>& links, const Tile* other) {
      for (const Link& l : links) {
        all.join(tile->first_component + l.here, other->first_component + l.there);
      }
    };
    join(tile->right, tile->right_tile);
    join(tile->above, tile->above_tile);
  }
  std::vector<char> reached = voted(all, static_cast<std::size_t>(count));
  float height = std::numeric_limits<float>::quiet_NaN();
  floor_under_path = std::find(reached.begin(), reached.end(), 1) != reached.end();
  if (count > 0 && (few || !floor_under_path)) {
    const auto pieces = raster::floor_pieces(floors, all, static_cast<std::size_t>(count));
    const std::size_t largest = raster::largest(pieces);
    if (!floor_under_path || raster::carried_over(pieces, reached, largest)) {
      std::fill(reached.begin(), reached.end(), 0);
      reached[largest] = 1;
      height = static_cast<float>(pieces[largest].height());
      floor_under_path = false;
    }
  }
  if (!(height == fallback || (std::isnan(height) && std::isnan(fallback)))) {
    for (Tile* tile : in_order) choose_again(*tile);
  }
  fallback = height;
  spread(floors, all, reached);
}

void Rasterizer::State::spread(const std::vector<Tile*>& floors, Components& all,
                               const std::vector<char>& reached) {
  for (Tile* tile : floors) {
    bool changed = tile->reached.size() != static_cast<std::size_t>(tile->components);
    tile->reached.resize(static_cast<std::size_t>(tile->components));
    for (std::int32_t k = 0; k < tile->components; ++k) {
      char& is = tile->reached[static_cast<std::size_t>(k)];
      const char now = reached[static_cast<std::size_t>(all.root(tile->first_component + k))];
      changed = changed || is != now;
      is = now;
    }
    if (changed) choose_again(*tile);
  }
}

void Rasterizer::State::choose_again(Tile& tile) {
  if (!tile.waiting) book.marked.push_back(&tile);
  tile.waiting = tile.rechoose = true;
}

void Rasterizer::State::write(const CellIndex& c, const NavigabilityCell& cell) {
  if (cell.known() || cell.height == cell.height) {
    grid.at_or_new(c) = cell;
  } else if (NavigabilityCell* old = grid.find(c)) {
    *old = cell;
  }
}

Neighbourhood Rasterizer::State::neighbourhood(const TileKey& key) const {
  Neighbourhood around;
  for (int dj = -1; dj <= 1; ++dj) {
    for (int di = -1; di <= 1; ++di) {
      around.tiles[static_cast<std::size_t>(3 * (dj + 1) + di + 1)] = tile_at(key, di, dj);
    }
  }
  return around;
}

void Rasterizer::State::look(Tile& tile) {
  if (tile.sites.empty()) return;
  const Neighbourhood around = neighbourhood(key_of(tile));
  tile.dirty.for_each([&](int i, int j) {
    look_around({around, i, j, 1}, options, tile.sites[static_cast<std::size_t>(cell_in(i, j))]);
  });
}

void Rasterizer::State::judge(Tile& tile) {
  const Neighbourhood around = neighbourhood(key_of(tile));
  const int reach = verdict_reach(options);
  tile.dirty.for_each([&](int i, int j) {
    write({tile.first.i + i, tile.first.j + j}, verdict({around, i, j, reach}, options));
  });
}

// The cells that changed, and `margin` cells around them.
void Rasterizer::State::around_changed(const std::vector<Tile*>& changed, int margin,
                                       void (State::*what)(Tile&)) {
  std::vector<Tile*> touched;
  for (Tile* tile : changed) {
    const TileKey key = key_of(*tile);
    const std::array<CellMask, 9> masks = grown(tile->changed, margin);
    for (std::size_t k = 0; k < masks.size(); ++k) {
      Tile* other =
          k == 4 ? tile : tile_at(key, static_cast<int>(k % 3) - 1, static_cast<int>(k / 3) - 1);
      if (other == nullptr || (other != tile && other->sites.empty()) || !masks[k].any()) continue;
      if (!other->dirty.any()) touched.push_back(other);
      other->dirty |= masks[k];
    }
  }
  for (Tile* tile : touched) {
    before_each();
    (this->*what)(*tile);
    tile->dirty = {};
  }
}

// A verdict looks two cells around, or as far as edges matter, at what these know of those beside
// them.
void Rasterizer::State::judge() {
  std::vector<Tile*> changed;
  for (Tile* tile : book.marked) {
    // The path's height matters where no floor is connected to it.
    const bool lost =
        std::find(tile->reached.begin(), tile->reached.end(), 1) == tile->reached.end();
    tile->rechoose = tile->rechoose || (tile->rerefer && lost);
    if (!tile->rechoose) continue;
    before_each();
    if (!tile->has_evidence() && tile->sites.empty()) continue;
    raster::choose_again(book.references, fallback, options, *tile);
    if (tile->changed.any()) changed.push_back(tile);
  }
  around_changed(changed, 1, &State::look);
  around_changed(changed, std::max(verdict_reach(options), edge_cells(options) + 1), &State::judge);
  for (Tile* tile : book.marked) {
    tile->redraw = tile->reseed = tile->rerefer = tile->rechoose = tile->waiting = false;
  }
  book.marked.clear();
}

Rasterizer::Rasterizer(const RasterOptions& options) {
  const std::vector<std::string> problems = options.problems();
  if (!problems.empty()) throw Error(problems.front());
  state_ = std::make_unique<State>(options);
}
Rasterizer::~Rasterizer() = default;
Rasterizer::Rasterizer(Rasterizer&&) noexcept = default;
Rasterizer& Rasterizer::operator=(Rasterizer&&) noexcept = default;

void Rasterizer::update(const PlanarMap& map) {
  state_->book.update(map);
  state_->draw(map);
  state_->reach();
  state_->judge();
}

void Rasterizer::update(const PlanarMap& map, const RasterChanges& changes) {
  state_->book.update(map, changes);
  state_->draw(map);
  state_->reach();
  state_->judge();
}

void Rasterizer::before_each_tile(std::function<void()> call) {
  state_->before_each = std::move(call);
}
const NavigabilityGrid& Rasterizer::grid() const { return state_->grid; }
NavigabilityGrid Rasterizer::take_grid() && { return std::move(state_->grid); }
std::size_t Rasterizer::tiles_drawn() const { return state_->drawn; }
UnknownCause Rasterizer::unknown_cause(const CellIndex& cell) const {
  const auto tile = [](std::int32_t x) { return (x - (x < 0 ? kSide - 1 : 0)) / kSide; };
  const TileKey key{tile(cell.j), tile(cell.i)};
  UnknownCause unknown_cause = UnknownCause::kNotSeen;
  const Neighbourhood around = state_->neighbourhood(key);
  const int i = cell.i - key.second * kSide, j = cell.j - key.first * kSide;
  verdict({around, i, j, verdict_reach(state_->options)}, state_->options, &unknown_cause);
  return unknown_cause;
}
std::vector<SolidCell> Rasterizer::solid_cells() const {
  std::vector<SolidCell> solid;
  for (const auto& [key, tile] : state_->book.tiles) {
    for (int c = 0; c < kCells && !tile->sites.empty(); ++c) {
      const Site& site = tile->sites[static_cast<std::size_t>(c)];
      if (!site.blocked) continue;
      const float base = site.supported ? site.height : site.reference;
      const float low = lowest_solid(*tile, c, base, state_->options);
      solid.push_back({{tile->first.i + c % kSide, tile->first.j + c / kSide},
                       static_cast<double>(base),
                       static_cast<double>(low),
                       static_cast<double>(site.top)});
    }
  }
  return solid;
}
bool Rasterizer::floor_seen() const { return state_->floor_seen; }
bool Rasterizer::floor_under_path() const { return state_->floor_under_path; }

NavigabilityGrid rasterize(const PlanarMap& map, const RasterOptions& options) {
  Rasterizer rasterizer(options);
  rasterizer.update(map);
  return std::move(rasterizer).take_grid();
}

}  // namespace lamina
