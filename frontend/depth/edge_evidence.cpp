// Two surfaces and a straight line between them, or three surfaces?
#include <lamina/frontend/depth/edge_evidence.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace lamina {
namespace {

constexpr int kBeyond = 4;       // px, of the window beyond the region's pixels
constexpr int kLook = 16;        // px: how far a neighbour may be
constexpr double kMost = 9;      // variances: more is an outlier
constexpr int kLines = 32;       // looked at, about
constexpr std::size_t kFew = 8;  // lines
constexpr double kNever = std::numeric_limits<double>::infinity();

// The image with lines along the region's narrow side: columns, or rows.
struct Turned {
  const DisparityImage& image;
  const DisparityGeometry& g;
  const std::vector<std::uint8_t>& labels;
  bool rows;  // lines are rows

  int lines() const { return rows ? image.height : image.width; }
  int length() const { return rows ? image.width : image.height; }
  std::size_t index(int line, int i) const {
    return static_cast<std::size_t>(rows ? line : i) * static_cast<std::size_t>(image.width) +
           static_cast<std::size_t>(rows ? i : line);
  }
  std::uint8_t label(int line, int i) const { return labels[index(line, i)]; }
  // What a pixel costs on a plane; nothing where nothing was measured.
  double cost(int line, int i, const DisparityPlane& plane, double variance) const {
    const auto d = static_cast<double>(image.d[index(line, i)]);
    if (!(d > 0)) return 0;
    const double u = (rows ? i : line) - g.cx, v = (rows ? line : i) - g.cy;
    const double r = d - (plane.x() * u + plane.y() * v + plane.z());
    return std::min(kMost, r * r / variance);
  }
};

// A line across the region: its pixels are [begin, end), the window is [from, from + size).
struct Line {
  int at = 0, begin = 0, end = 0;
  std::uint8_t before = 0, after = 0;  // labels of the neighbours
  int from = 0;
  std::vector<double> first{}, second{}, either{};  // running costs of the window
  double own = 0;                                   // with the region between the two
  std::vector<double> parted{};  // cost when the neighbours meet at from - 1, from, ...
  double share = 0;              // how far it is from the first of the lines to the last
  double rest = 0;               // the least that the lines after it can cost
};

std::uint8_t neighbour(const Turned& t, int line, int i, int direction, std::uint8_t mark) {
  for (int k = 0; k < kLook; ++k, i += direction) {
    if (i < 0 || i >= t.length()) return 0;
    const std::uint8_t label = t.label(line, i);
    if (label != 0 && label != mark) return label;
  }
  return 0;
}

std::vector<Line> lines_of(const Turned& t, std::uint8_t mark, const PixelBox& box) {
  std::vector<Line> lines;
  const int first = t.rows ? box.v0 : box.u0, last = t.rows ? box.v1 : box.u1;
  const int low = t.rows ? box.u0 : box.v0, high = t.rows ? box.u1 : box.v1;
  const int step = std::max(1, (last - first) / kLines);
  for (int line = first + step / 2; line < last; line += step) {
    Line l;
    l.at = line;
    l.begin = high;
    for (int i = low; i < high; ++i) {
      if (t.label(line, i) != mark) continue;
      l.begin = std::min(l.begin, i);
      l.end = i + 1;
    }
    if (l.end == 0) continue;
    l.before = neighbour(t, line, l.begin - 1, -1, mark);
    l.after = neighbour(t, line, l.end, 1, mark);
    lines.push_back(std::move(l));
  }
  return lines;
}

// The pair of neighbours that most lines have.
std::pair<std::uint8_t, std::uint8_t> usual_neighbours(const std::vector<Line>& lines) {
  std::pair<std::uint8_t, std::uint8_t> usual{0, 0};
  std::ptrdiff_t most = 0;
  for (const Line& l : lines) {
    const auto n = std::count_if(lines.begin(), lines.end(), [&l](const Line& other) {
      return other.before == l.before && other.after == l.after;
    });
    if (n > most && l.before != 0 && l.after != 0) {
      most = n;
      usual = {l.before, l.after};
    }
  }
  if (2 * most <= static_cast<std::ptrdiff_t>(lines.size())) usual = {0, 0};
  return usual;
}

// What a line's window costs wherever in it, or beside it, the neighbours meet.
void part(Line& l) {
  const int size = static_cast<int>(l.first.size()) - 1;
  l.parted.reserve(static_cast<std::size_t>(size) + 3);
  const auto place = [size](int i) { return static_cast<std::size_t>(std::clamp(i, 0, size)); };
  for (int border = -1; border <= size + 1; ++border) {
    const std::size_t low = place(border - 1), high = place(border + 1);
    l.parted.push_back(l.first[low] + (l.either[high] - l.either[low]) +
                       (l.second.back() - l.second[high]));
  }
}

// Shares of the way, and what is left of the costs at least.
void prepare(std::vector<Line>& lines) {
  const int at = lines.front().at, all = std::max(1, lines.back().at - at);
  double rest = 0;
  for (auto l = lines.rbegin(); l != lines.rend(); ++l) {
    part(*l);
    l->share = static_cast<double>(l->at - at) / all;
    l->rest = rest * (1 - 1e-9);  // more than rounding may not be lost
    rest += *std::min_element(l->parted.begin(), l->parted.end());
  }
}

double parted(const Line& l, int border) {
  const int last = static_cast<int>(l.parted.size()) - 1;
  return l.parted[static_cast<std::size_t>(std::clamp(border - l.from + 1, 0, last))];
}

// As std::lround, which is a call here.
int nearest(double x) {
  const int whole = static_cast<int>(x);
  const double more = x - whole;
  return whole + (more >= 0.5) - (more <= -0.5);
}

// Cost of all windows when the neighbours meet on the line from p to q; `most` or more is kNever.
double parted(const std::vector<Line>& lines, int p, int q, double most) {
  double sum = 0;
  for (const Line& l : lines) {
    sum += parted(l, nearest(p + l.share * (q - p)));
    if (sum + l.rest >= most) return kNever;
  }
  return sum;
}

// A range of places, some of them looked at.
struct Places {
  int low, high, step;
};

// The least cost of a straight border, and where it crosses the first and the last of the lines.
struct Border {
  int first = 0, last = 0;
  double cost = kNever;
};
// Borders that cost `most` or more are none; the first below `enough` will do.
Border best_border(const std::vector<Line>& lines, const Places& first, const Places& last,
                   double most, double enough) {
  Border best{0, 0, most};
  for (int p = first.low; p <= first.high; p += first.step) {
    for (int q = last.low; q <= last.high; q += last.step) {
      const double sum = parted(lines, p, q, best.cost);
      if (sum < best.cost) best = {p, q, sum};
      if (best.cost < enough) return best;
    }
  }
  return best;
}

// All borders of narrow lines; of wide ones (stray pixels beside them) some, and all about the
// best. What is asked is whether the least is below `limit`: it is looked for no further than that.
double least_parted(const std::vector<Line>& lines, double limit) {
  constexpr int kAll = 32;         // px
  constexpr double kRound = 1e-9;  // more than rounding
  const double most = limit * (1 + kRound), enough = limit * (1 - kRound);
  const auto places = [](const Line& l) {
    const int low = l.begin - kBeyond, high = l.end + kBeyond;
    return Places{low, high, 1 + (high - low) / kAll};
  };
  const auto about = [](const Places& coarse, int best) {
    return Places{std::max(coarse.low, best - coarse.step),
                  std::min(coarse.high, best + coarse.step), 1};
  };
  const Places first = places(lines.front()), last = places(lines.back());
  const bool all = first.step == 1 && last.step == 1;
  const Border coarse = best_border(lines, first, last, all ? most : kNever, enough);
  if (all || coarse.cost < enough) return coarse.cost;
  const Border fine =
      best_border(lines, about(first, coarse.first), about(last, coarse.last), most, enough);
  return std::min(coarse.cost, fine.cost);
}

}  // namespace

EdgeEvidence edge_evidence(const DisparityImage& image, const DisparityGeometry& g,
                           const std::vector<std::uint8_t>& pixel_labels,
                           const std::vector<PlaneRegion>& regions, std::size_t k,
                           const PixelBox& box, bool rows, double variance) {
  const Turned t{image, g, pixel_labels, rows};
  std::vector<Line> lines = lines_of(t, static_cast<std::uint8_t>(k + 1), box);
  const auto [before, after] = usual_neighbours(lines);
  if (before == 0) return {};
  std::erase_if(lines,
                [b = before, a = after](const Line& l) { return l.before != b || l.after != a; });
  if (lines.size() < kFew) return {};
  const DisparityPlane &first = regions[before - 1U].plane, &second = regions[after - 1U].plane;
  EdgeEvidence evidence;
  for (Line& l : lines) {
    l.from = std::max(0, l.begin - kBeyond);
    const int to = std::min(t.length(), l.end + kBeyond);
    for (auto* costs : {&l.first, &l.second, &l.either}) {
      costs->reserve(static_cast<std::size_t>(std::max(0, to - l.from)) + 1);
      costs->assign(1, 0);
    }
    for (int i = l.from; i < to; ++i) {
      const double a = t.cost(l.at, i, first, variance), b = t.cost(l.at, i, second, variance);
      l.first.push_back(l.first.back() + a);
      l.second.push_back(l.second.back() + b);
      l.either.push_back(l.either.back() + std::min(a, b));
      l.own += i < l.begin ? a : i >= l.end ? b : t.cost(l.at, i, regions[k].plane, variance);
    }
  }
  prepare(lines);
  evidence.lines = static_cast<int>(lines.size());
  double own = 0;
  for (const Line& l : lines) own += l.own;
  evidence.gain = least_parted(lines, own + EdgeEvidence::kLeast * evidence.lines);
  for (const Line& l : lines) evidence.gain -= l.own;
  return evidence;
}

}  // namespace lamina
