// Each stream by itself first, then those without a clock by those that have one.
#include <lamina/models/median.hpp>
#include <lamina/sensors/clock_order.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace lamina {
namespace {

struct Anchor {
  double line = 0;
  Timestamp stamp;
};

// Where a line stands in time between the two anchors about it, or beyond the ends at their rate.
Timestamp time_at(const std::vector<Anchor>& anchors, double line) {
  if (anchors.size() < 2) return anchors.front().stamp;
  auto after = std::lower_bound(anchors.begin(), anchors.end(), line,
                                [](const Anchor& a, double l) { return a.line < l; });
  if (after != anchors.begin() && after != anchors.end()) {
    const Anchor& a = *(after - 1);
    const double span = std::max(1.0, after->line - a.line);
    return a.stamp + (line - a.line) / span * (after->stamp - a.stamp);
  }
  const Anchor& end = after == anchors.end() ? anchors.back() : anchors.front();
  const double rate =
      (anchors.back().stamp - anchors.front().stamp) / (anchors.back().line - anchors.front().line);
  return end.stamp + (line - end.line) * rate;
}

void make_increase(std::vector<Timestamp>& stamps) {
  constexpr double kLeast = 1e-6;  // s
  for (std::size_t i = 1; i < stamps.size(); ++i) {
    if (stamps[i] <= stamps[i - 1]) stamps[i] = stamps[i - 1] + kLeast;
  }
}

class Orderer {
 public:
  Orderer(std::span<const ClockStream> streams, const ClockOrderOptions& options)
      : streams_(streams), options_(options), result_{} {
    result_.stamps.resize(streams.size());
  }

  OrderedClock run() {
    for (const ClockStream& stream : streams_) series_.push_back(ordered_stamps(stream.stamps));
    for (std::size_t s = 0; s < streams_.size(); ++s) {
      if (!series_[s]) continue;
      result_.stamps[s] = series_[s]->stamps;
      report(streams_[s], *series_[s]);
    }
    bring_together();
    for (std::size_t s = 0; s < streams_.size(); ++s) {
      if (!series_[s]) lay_by_lines(s);
    }
    return std::move(result_);
  }

 private:
  void report(const ClockStream& stream, const StampSeries& series);
  void bring_together();
  void lay_by_lines(std::size_t s);
  std::string place(const ClockStream& stream, std::size_t record) const {
    return options_.place(stream.lines.empty() ? record : stream.lines[record]);
  }
  void say(bool loud, const std::string& id, const std::string& text) {
    if (loud) add_warnings(result_.warnings, {{id, text}});
    if (!loud) result_.remarks.push_back(text);
  }

  std::span<const ClockStream> streams_;
  ClockOrderOptions options_;
  std::vector<std::optional<StampSeries>> series_;
  OrderedClock result_;
};

void Orderer::report(const ClockStream& stream, const StampSeries& series) {
  if (!series.first) return;
  const std::string where = place(stream, *series.first);
  const auto all = static_cast<double>(stream.stamps.size());
  if (!series.steps.empty()) {
    double largest = 0;
    for (const ClockStep& step : series.steps) {
      if (std::abs(step.back) > std::abs(largest)) largest = step.back;
    }
    say(true, "clock_order",
        fmt::format(
            "clock of {} {} by {:.4g} s, {} in all, first at {}: taken out, times after "
            "it go on where it stood",
            stream.name, largest > 0 ? "set back" : "leaps ahead", std::abs(largest),
            series.steps.size() == 1 ? "once" : fmt::format("{} times", series.steps.size()),
            where));
  } else if (series.unordered > 0) {
    say(static_cast<double>(series.unordered) > options_.worth_saying * all, "clock_order",
        fmt::format("{} of {} stamps of {} are absent, equal or go back, first at {}: {} of them "
                    "replaced by the order of lines, {:.4g} s apart as usual",
                    series.unordered, stream.stamps.size(), stream.name, where, series.retimed,
                    series.interval));
  }
  if (series.bursts > 0) {
    say(true, "stamps_in_bursts",
        fmt::format("{} {} after which {} came at once, first at {}: stamps are those of arrival; "
                    "spread evenly, {:.4g} s apart",
                    series.bursts, series.bursts == 1 ? "stall" : "stalls", stream.name, where,
                    series.interval));
  }
}

// Clocks that are days apart: what stands in neighbouring lines was written at about one time.
void Orderer::bring_together() {
  if (streams_.empty() || !series_[0] || streams_[0].lines.empty()) return;
  for (std::size_t s = 1; s < streams_.size(); ++s) {
    if (!series_[s] || streams_[s].lines.empty()) continue;
    std::vector<Anchor> anchors;
    for (std::size_t i = 0; i < streams_[s].lines.size(); ++i) {
      anchors.push_back({static_cast<double>(streams_[s].lines[i]), result_.stamps[s][i]});
    }
    if (anchors.size() < 2) continue;
    std::vector<double> apart;
    for (std::size_t i = 0; i < streams_[0].lines.size(); ++i) {
      apart.push_back(result_.stamps[0][i] -
                      time_at(anchors, static_cast<double>(streams_[0].lines[i])));
    }
    const auto middle = median(apart);
    if (!(std::abs(middle) > options_.apart)) continue;
    for (Timestamp& stamp : result_.stamps[s]) stamp = stamp + middle;
    say(true, "clocks_apart",
        fmt::format("clocks of {} and {} are {:.6g} s apart: {} moved to where its lines stand",
                    streams_[0].name, streams_[s].name, std::abs(middle), streams_[s].name));
  }
}

void Orderer::lay_by_lines(std::size_t s) {
  const ClockStream& stream = streams_[s];
  std::vector<Anchor> anchors;
  for (std::size_t o = 0; o < streams_.size(); ++o) {
    if (!series_[o] || streams_[o].lines.empty() || stream.lines.empty()) continue;
    for (std::size_t i = 0; i < streams_[o].lines.size(); ++i) {
      anchors.push_back({static_cast<double>(streams_[o].lines[i]), result_.stamps[o][i]});
    }
  }
  std::stable_sort(anchors.begin(), anchors.end(),
                   [](const Anchor& a, const Anchor& b) { return a.line < b.line; });
  const bool made_up = anchors.size() < 2;
  if (made_up) {
    const ClockStream& first = streams_[0];
    const std::size_t records = first.stamps.size();
    const bool lines = !first.lines.empty() && records > 1;
    const double between = lines ? static_cast<double>(first.lines.back() - first.lines.front()) /
                                       static_cast<double>(records - 1)
                                 : 1;
    // On from the first stamp there is, if that is one.
    const auto begin = first.stamps.empty() ? std::nullopt : first.stamps.front();
    const Timestamp origin = begin.value_or(Timestamp());
    const double from = lines ? static_cast<double>(first.lines.front()) : 0;
    anchors = {{from, origin}, {from + between, origin + options_.nominal_interval}};
  }
  for (std::size_t i = 0; i < stream.stamps.size(); ++i) {
    const std::size_t line = stream.lines.empty() ? i : stream.lines[i];
    result_.stamps[s].push_back(time_at(anchors, static_cast<double>(line)));
  }
  make_increase(result_.stamps[s]);
  say(true, "clock_order",
      fmt::format(
          "stamps of {} cannot order them (equal, absent or rubbish, first at {}): their {} "
          "lines are read in order, {}",
          stream.name, place(stream, 0), stream.stamps.size(),
          made_up ? fmt::format("evenly: times are made up ({:.3g} s a scan)",
                                options_.nominal_interval)
                  : std::string("at the times of the lines about them")));
}

}  // namespace

void add_warnings(std::vector<Warning>& to, const std::vector<Warning>& more) {
  for (const Warning& warning : more) {
    const auto same = std::find_if(to.begin(), to.end(),
                                   [&](const Warning& other) { return other.id == warning.id; });
    if (same != to.end()) same->text += "; " + warning.text;
    if (same == to.end()) to.push_back(warning);
  }
}

std::map<Timestamp, Timestamp> where_increasing(const std::map<Timestamp, Timestamp>& recorded,
                                                std::span<const Timestamp> frames) {
  std::optional<Timestamp> last;
  for (const Timestamp used : frames) {
    const auto found = recorded.find(used);
    const Timestamp stamp = found == recorded.end() ? used : found->second;
    if (last && stamp <= *last) return {};
    last = stamp;
  }
  return recorded;
}

OrderedClock order_clocks(std::span<const ClockStream> streams, const ClockOrderOptions& options) {
  return Orderer(streams, options).run();
}

}  // namespace lamina
