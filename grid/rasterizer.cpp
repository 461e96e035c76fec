// Tiles drawn, joined to floors, and judged.
#include <lamina/grid/rasterizer.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include <lamina/grid/raster_book.hpp>
#include <lamina/models/error.hpp>

namespace lamina {

using namespace raster;

struct Rasterizer::State {
  RasterOptions options;
  Book book;
  NavigabilityGrid grid;
  float fallback = std::numeric_limits<float>::quiet_NaN();
  std::size_t drawn = 0;
  bool floor_seen = false, floor_under_path = false;

  explicit State(const RasterOptions& o) : options(o), book(o), grid(o.resolution) {}
  Tile* tile_at(const TileKey& key, int di, int dj) const {
    const auto it = book.tiles.find({key.first + dj, key.second + di});
    return it == book.tiles.end() ? nullptr : it->second.get();
  }
  void draw(const PlanarMap& map);
  void link(const TileKey& key, Tile& tile) const;
  void reach();
  float floor_height(const std::vector<Tile*>& floors, Components& all, std::int32_t floor) const;
  std::vector<char> voted(const std::vector<Tile*>& floors, Components& all,
                          std::size_t count) const;
  std::int32_t largest(const std::vector<Tile*>& floors, Components& all, std::size_t count) const;
  void spread(const std::vector<Tile*>& floors, Components& all, const std::vector<char>& reached);
  void choose_again(Tile& tile);
  void judge();
  void judge(const TileKey& key, int i0, int j0, int i1, int j1);
  Neighbourhood neighbourhood(const TileKey& key) const;
  void write(const CellIndex& c, const NavigabilityCell& cell);
};

// Steps of one update.
void Rasterizer::State::draw(const PlanarMap& map) {
  drawn = 0;
  std::vector<TileKey> linked;
  for (Tile* tile : book.marked) {
    const TileKey key = key_of(*tile);
    if (tile->redraw) {
      if (tile->has_evidence() || !tile->sites.empty()) {
        draw_evidence(map, options, *tile);
        label_components(options, *tile);
        ++drawn;
        linked.insert(linked.end(),
                      {key, {key.first, key.second - 1}, {key.first - 1, key.second}});
      }
      tile->reseed = tile->rechoose = true;
    }
    if (tile->reseed) find_seeds(book.seeds, options, *tile);
  }
  std::sort(linked.begin(), linked.end());
  linked.erase(std::unique(linked.begin(), linked.end()), linked.end());
  for (const TileKey& key : linked) {
    if (Tile* tile = tile_at(key, 0, 0)) link(key, *tile);
  }
}

void Rasterizer::State::link(const TileKey& key, Tile& tile) const {
  const auto join = [&](const Tile* other, std::vector<Link>& links, bool to_right) {
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
  join(tile.above_tile, tile.above, false);
}

// The components that are best under some pose of the path, by root.
std::vector<char> Rasterizer::State::voted(const std::vector<Tile*>& floors, Components& all,
                                           std::size_t count) const {
  std::vector<std::pair<double, std::int32_t>> best(book.seeds.size(), {1e300, -1});
  for (const Tile* tile : floors) {
    for (const Vote& vote : tile->votes) {
      auto& leader = best[static_cast<std::size_t>(vote.pose)];
      const std::pair<double, std::int32_t> now{vote.score, tile->first_component + vote.component};
      if (now < leader) leader = now;
    }
  }
  std::vector<char> reached(count, 0);
  for (const auto& [score, component] : best) {
    if (component >= 0) reached[static_cast<std::size_t>(all.root(component))] = 1;
  }
  return reached;
}

std::int32_t Rasterizer::State::largest(const std::vector<Tile*>& floors, Components& all,
                                        std::size_t count) const {
  std::vector<std::int64_t> size(count, 0);
  for (const Tile* tile : floors) {
    for (std::int32_t k = 0; k < tile->components; ++k) {
      size[static_cast<std::size_t>(all.root(tile->first_component + k))] +=
          tile->sizes[static_cast<std::size_t>(k)];
    }
  }
  return static_cast<std::int32_t>(std::max_element(size.begin(), size.end()) - size.begin());
}

// Components of all tiles, joined over their borders; those under the path are the robot's floor.
// Where the path lies on no floor (a hand-held camera) it is the largest of all.
void Rasterizer::State::reach() {
  std::vector<Tile*> floors;
  std::int32_t count = 0;
  for (const auto& [key, tile] : book.tiles) {
    if (tile->components == 0) {
      tile->reached.clear();
      continue;
    }
    tile->first_component = count;
    count += tile->components;
    floors.push_back(tile.get());
  }
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
  std::vector<char> reached = voted(floors, all, static_cast<std::size_t>(count));
  float height = std::numeric_limits<float>::quiet_NaN();
  floor_under_path = std::find(reached.begin(), reached.end(), 1) != reached.end();
  if (count > 0 && !floor_under_path) {
    const std::int32_t floor = largest(floors, all, static_cast<std::size_t>(count));
    reached[static_cast<std::size_t>(floor)] = 1;
    height = floor_height(floors, all, floor);
  }
  if (!(height == fallback || (std::isnan(height) && std::isnan(fallback)))) {
    for (const auto& [key, tile] : book.tiles) choose_again(*tile);
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

float Rasterizer::State::floor_height(const std::vector<Tile*>& floors, Components& all,
                                      std::int32_t floor) const {
  double sum = 0;
  std::int64_t n = 0;
  for (const Tile* tile : floors) {
    for (const Level& level : tile->levels) {
      if (all.root(tile->first_component + level.component) != floor) continue;
      sum += static_cast<double>(level.surface.height);
      ++n;
    }
  }
  return static_cast<float>(sum / static_cast<double>(std::max<std::int64_t>(n, 1)));
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

void Rasterizer::State::judge(const TileKey& key, int i0, int j0, int i1, int j1) {
  const Neighbourhood around = neighbourhood(key);
  const CellIndex first{key.second * kSide, key.first * kSide};
  for (int j = j0; j < j1; ++j) {
    for (int i = i0; i < i1; ++i) {
      write({first.i + i, first.j + j}, verdict(around, i, j, options));
    }
  }
}

// A verdict looks at sites two cells around.
void Rasterizer::State::judge() {
  static constexpr int kMargin = 2;
  std::vector<TileKey> changed;
  for (Tile* tile : book.marked) {
    // The path's height matters where no floor is connected to it.
    const bool lost =
        std::find(tile->reached.begin(), tile->reached.end(), 1) == tile->reached.end();
    tile->rechoose = tile->rechoose || (tile->rerefer && lost);
    if (!tile->rechoose) continue;
    if (!tile->has_evidence() && tile->sites.empty()) continue;
    if (tile->has_evidence()) {
      choose_sites(book.references, fallback, options, *tile);
    } else {
      tile->sites.clear();
    }
    changed.push_back(key_of(*tile));
  }
  const auto strip = [](int d) {
    return d < 0   ? std::pair(kSide - kMargin, kSide)
           : d > 0 ? std::pair(0, kMargin)
                   : std::pair(0, kSide);
  };
  for (const TileKey& key : changed) {
    judge(key, 0, 0, kSide, kSide);
    for (int dj = -1; dj <= 1; ++dj) {
      for (int di = -1; di <= 1; ++di) {
        const Tile* tile = tile_at(key, di, dj);
        if (tile == nullptr || tile->sites.empty() || tile->rechoose) continue;
        const auto [i0, i1] = strip(di);
        const auto [j0, j1] = strip(dj);
        judge({key.first + dj, key.second + di}, i0, j0, i1, j1);
      }
    }
  }
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

const NavigabilityGrid& Rasterizer::grid() const { return state_->grid; }
NavigabilityGrid Rasterizer::take_grid() && { return std::move(state_->grid); }
std::size_t Rasterizer::tiles_drawn() const { return state_->drawn; }
Doubt Rasterizer::doubt(const CellIndex& cell) const {
  const auto tile = [](std::int32_t x) { return (x - (x < 0 ? kSide - 1 : 0)) / kSide; };
  const TileKey key{tile(cell.j), tile(cell.i)};
  Doubt doubt = Doubt::kNotSeen;
  verdict(state_->neighbourhood(key), cell.i - key.second * kSide, cell.j - key.first * kSide,
          state_->options, &doubt);
  return doubt;
}
bool Rasterizer::floor_seen() const { return state_->floor_seen; }
bool Rasterizer::floor_under_path() const { return state_->floor_under_path; }

NavigabilityGrid rasterize(const PlanarMap& map, const RasterOptions& options) {
  Rasterizer rasterizer(options);
  rasterizer.update(map);
  return std::move(rasterizer).take_grid();
}

}  // namespace lamina
