// Stamps of one stream whose order is known: those that cannot be are replaced.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include <lamina/models/timestamp.hpp>

namespace lamina {

struct SeriesOptions {
  /// Share of stamps outside the longest increasing run up to which each is an accident of its own
  /// and laid between its neighbours; above, the whole stream is laid on its usual period.
  double few = 0.2;
  /// Share of stamps that must be later than those 20 records before, or they are rubbish.
  double growing = 0.8;
  /// A clock that is set back more often has jitter, not steps.
  std::size_t most_steps = 5;
  /// Stamps to either side that say where one belongs: white jitter falls by the root of them.
  std::size_t half_window = 25;
  /// s; a clock that leaps ahead by more has been set or ran over, nobody waited as long.
  double longest_pause = 1e6;
  /// s, and in usual intervals: a silence that may be a stall, after which what was held back comes
  /// at once.
  double stall_s = 1, stall = 4;
  /// Of the usual interval: others within it are as usual.
  double as_usual = 0.3;
  /// In usual intervals: stamps nearer to each other are of one burst.
  double burst = 0.2;
  /// How many come at once at least.
  std::size_t burst_count = 4;
  /// Share of the intervals that must be as usual: else the stream has no period to be laid on.
  double periodic = 0.7;
};

/// From record `at` on the clock was set back by `back` (s; negative: ahead).
struct ClockStep {
  std::size_t at = 0;
  double back = 0;
};

struct StampSeries {
  std::vector<Timestamp> stamps;     ///< one a record, strictly increasing
  std::vector<ClockStep> steps;      ///< taken out
  std::size_t unordered = 0;         ///< stamps absent, equal to the one before, or before it
  std::size_t bursts = 0;            ///< stalls after which several came at once
  std::size_t retimed = 0;           ///< records whose stamp is not the recorded one
  std::optional<std::size_t> first;  ///< the first record at fault
  double interval = 0;               ///< s, usual; 0: not known
};

/// Whether lines stand in another order than was measured: more than `few` of the stamps go back,
/// and yet put in order `periodic` of them follow each other at the usual interval, which neither
/// jitter nor clocks that are set back leave.
bool is_shuffled(std::span<const Timestamp> stamps, const SeriesOptions& options = {});

/// nullopt where the stamps say nothing: fewer than a few different ones. Stamps that increase
/// strictly, without bursts and leaps, come back as they are.
std::optional<StampSeries> ordered_stamps(std::span<const std::optional<Timestamp>> recorded,
                                          const SeriesOptions& options = {});

}  // namespace lamina
