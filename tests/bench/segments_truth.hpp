// Tracks of segments against the truth of a simulated recording: switches of id, false matches.
#pragma once

#include <algorithm>
#include <cstdio>
#include <map>
#include <vector>

#include <lamina/models/observation.hpp>

namespace lamina {

/// Walls seen without a break keep their ids. A piece of a wall is what was extracted of one true
/// plane in one scan. It continues a piece of the scan before when that is of the same plane and
/// more than half of the shorter is common to both; so a wall is continuously seen as long as every
/// scan has a piece that continues one of the scan before. A piece whose track does not count yet
/// (id -1) hands on the ids of those that it continues. A switch: a piece under an id that none of
/// the pieces it continues has or hands on, when there is such an id. Where all those ids were
/// false matches, counted as such already, the new id is their end and counted apart.
class TrackTruth {
 public:
  explicit TrackTruth(std::vector<Plane> planes_map, bool list = false)
      : planes_map_(std::move(planes_map)), list_(list) {}

  /// `plane_of_beam`: the true plane behind each beam, -1: none.
  void add(const Observations& out, const SE3& T_odom_body, const std::vector<int>& plane_of_beam) {
    std::vector<Piece> now;
    const SE3 T = T_odom_body * out.T_body_sensor;
    for (const SegmentObservation& s : out.segments) {
      const int plane = majority_plane(s.segment, plane_of_beam);
      ++segments_;
      no_plane_ += plane < 0 ? 1 : 0;
      if (plane < 0) continue;
      Piece piece{plane,
                  s.track,
                  T * Eigen::Vector3d(s.segment.start.x(), s.segment.start.y(), 0),
                  T * Eigen::Vector3d(s.segment.end.x(), s.segment.end.y(), 0),
                  {}};
      Ids before;
      for (const Piece& old : previous_) {
        if (old.plane == plane && overlap(piece, old))
          before.insert(old.ids.begin(), old.ids.end());
      }
      if (s.track < 0) {
        piece.ids = before;
      } else {
        piece.ids = {{s.track, count(piece, before)}};
      }
      now.push_back(piece);
    }
    previous_ = std::move(now);
    ++scan_;
  }

  void print() const {
    if (segments_ == 0) return;
    std::printf(
        "  truth: id switches %ld of %ld continued pieces (%.2f %%), false matches %ld of %ld "
        "(%.2f %%; ended by a new id %ld), segments on no plane %ld of %ld\n",
        switches_, continued_, share(switches_, continued_), false_matches_, matches_,
        share(false_matches_, matches_), ends_, no_plane_, segments_);
  }

 private:
  using Ids = std::map<std::int64_t, bool>;  // with: are they a false match of this wall?
  struct Piece {
    int plane;
    std::int64_t track;
    Eigen::Vector3d a, b;  // odometry frame
    Ids ids;
  };

  static double share(std::int64_t part, std::int64_t whole) {
    return whole == 0 ? 0 : 100.0 * static_cast<double>(part) / static_cast<double>(whole);
  }

  static int majority_plane(const ScanSegment& segment, const std::vector<int>& planes) {
    std::map<int, int> votes;
    const int n = static_cast<int>(planes.size());
    const int span = (segment.last_beam - segment.first_beam + n) % n;
    for (int i = 0; i <= span; ++i) {
      ++votes[planes[static_cast<std::size_t>((segment.first_beam + i) % n)]];
    }
    return std::max_element(votes.begin(), votes.end(),
                            [](const auto& a, const auto& b) { return a.second < b.second; })
        ->first;
  }

  static bool overlap(const Piece& p, const Piece& q) {
    const Eigen::Vector3d d = (p.b - p.a).normalized();
    const double length = (p.b - p.a).norm(), u = d.dot(q.a - p.a), v = d.dot(q.b - p.a);
    const double shared = std::min(length, std::max(u, v)) - std::max(0.0, std::min(u, v));
    return shared > 0.5 * std::min(length, std::abs(u - v));
  }

  static bool same_plane(const Plane& a, const Plane& b) {
    const double dot = a.normal().dot(b.normal());
    return std::abs(dot) > std::cos(1 * M_PI / 180) &&
           std::abs(a.rho() - (dot > 0 ? b.rho() : -b.rho())) < 0.03;
  }

  // True when the match is false.
  bool count(const Piece& piece, const Ids& before) {
    ++matches_;
    const int first = plane_of_track_.emplace(piece.track, piece.plane).first->second;
    const bool wrong = !same_plane(planes_map_[static_cast<std::size_t>(first)],
                                   planes_map_[static_cast<std::size_t>(piece.plane)]);
    false_matches_ += wrong ? 1 : 0;
    continued_ += before.empty() ? 0 : 1;
    const bool other = !before.empty() && before.count(piece.track) == 0;
    const bool ends = other && std::all_of(before.begin(), before.end(),
                                           [](const auto& id) { return id.second; });
    ends_ += ends ? 1 : 0;
    switches_ += other && !ends ? 1 : 0;
    if (list_ && (wrong || other)) list(piece, before, first, wrong);
    return wrong;
  }

  void list(const Piece& piece, const Ids& before, int first, bool wrong) const {
    std::printf(
        "  scan %ld: plane %d, %.2f m from (%.2f, %.2f, %.2f) to (%.2f, %.2f, %.2f), track %ld",
        scan_, piece.plane, (piece.b - piece.a).norm(), piece.a.x(), piece.a.y(), piece.a.z(),
        piece.b.x(), piece.b.y(), piece.b.z(), piece.track);
    if (wrong) std::printf(" of plane %d", first);
    if (before.count(piece.track) == 0) {
      for (const auto& [id, false_match] : before) {
        std::printf(", was %ld%s", id, false_match ? " falsely" : "");
      }
    }
    std::printf("\n");
  }

  std::vector<Plane> planes_map_;
  bool list_;
  std::int64_t scan_ = 0;
  std::vector<Piece> previous_;
  std::map<std::int64_t, int> plane_of_track_;
  std::int64_t matches_ = 0, continued_ = 0, switches_ = 0, ends_ = 0, false_matches_ = 0,
               no_plane_ = 0, segments_ = 0;
};

}  // namespace lamina
