// Accuracy and speed of the segment front-end on simulated rooms and polygons.
//   segments_bench
#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <map>
#include <numeric>
#include <set>

#include <lamina/frontend/motion/deskew.hpp>
#include <lamina/frontend/segments/segment_frontend.hpp>

#include "frontend/segments/scan_maker.hpp"

using namespace lamina;
using test::LineScore;
using test::ScanMaker;
using test::Wall;

namespace {

double microseconds() {
  return 1e6 *
         std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2),
                   values.end());
  return values[values.size() / 2];
}

double mean(const std::vector<double>& values) {
  return values.empty() ? 0
                        : std::accumulate(values.begin(), values.end(), 0.0) /
                              static_cast<double>(values.size());
}

// A room of 10 x 7 m with boxes in it, seen from a random place.
std::vector<Wall> furnished_room(std::mt19937& random) {
  std::uniform_real_distribution<double> unit;
  const double x = 3 + 4 * unit(random), y = 2 + 3 * unit(random), yaw = 2 * M_PI * unit(random);
  std::vector<Wall> walls = test::room(10, 7, x, y, yaw);
  for (int k = 0; k < 4; ++k) {
    const double w = 0.6 + unit(random), h = 0.6 + unit(random), turn = 2 * M_PI * unit(random);
    const double away = 1.6 + unit(random), bearing = 0.5 * M_PI * (k + unit(random));
    const Eigen::Vector2d centre(away * std::cos(bearing), away * std::sin(bearing));
    for (Wall wall : test::room(w, h, w / 2, h / 2, turn)) {
      walls.push_back({wall.a + centre, wall.b + centre});
    }
  }
  return walls;
}

using World = std::vector<Wall> (*)(std::mt19937&, int);

struct Case {
  const char* name;
  World make;
};

const Case kCases[] = {
    {"room 8 x 6 m",
     [](std::mt19937& r, int) {
       std::uniform_real_distribution<double> unit;
       return test::room(8, 6, 1 + 6 * unit(r), 1 + 4 * unit(r), 2 * M_PI * unit(r));
     }},
    {"furnished room", [](std::mt19937& r, int) { return furnished_room(r); }},
    {"polygons, 4-8 corners",
     [](std::mt19937& r, int k) { return test::random_polygon(r, 4 + k % 5, 2, 8); }},
    {"polygons, 9-14 corners",
     [](std::mt19937& r, int k) { return test::random_polygon(r, 9 + k % 6, 2, 8); }},
};

// What the extractor makes of each wall alone: the angle errors of a program that is told which
// return hit which wall, and does all else alike.
void add_told(const ScanMaker& maker, const LaserScan& scan, const std::vector<Wall>& walls,
              const std::vector<int>& hits, SegmentExtractor& extractor,
              std::vector<double>& angle_errors) {
  for (int w = 0; w < static_cast<int>(walls.size()); ++w) {
    LaserScan alone = scan;
    std::vector<int> own(hits.size(), -1);
    for (std::size_t i = 0; i < hits.size(); ++i) {
      if (hits[i] == w) {
        own[i] = w;
      } else {
        alone.ranges[i] = 0;
      }
    }
    const LineScore score = test::score(extractor.extract(alone).segments, maker.truth(walls, own),
                                        own, maker.noise.range_sigma);
    angle_errors.insert(angle_errors.end(), score.angle_errors.begin(), score.angle_errors.end());
  }
}

void accuracy() {
  std::printf(
      "%-24s %5s %6s  %7s %7s %7s  %8s %8s %8s  %12s %8s\n%-24s %5s %6s  %7s %7s %7s  %8s %8s %8s  "
      "%12s %8s\n",
      "world", "beams", "sigma", "recall", "false", "lines", "rho mm", "angle", "angle", "NEES (2)",
      "NEES of", "", "", "cm", "", "a scan", "a scan", "median", "median", "if told", "of one wall",
      "all");
  for (const Case& c : kCases) {
    for (const double sigma : {0.01, 0.03}) {
      for (const int beams : {361, 541, 1081}) {
        ScanMaker maker;
        maker.beams = beams;
        maker.noise = {sigma, 0.0005, 0.0};
        std::mt19937 random(1);
        SegmentExtractor extractor;
        LineScore total;
        std::vector<double> observed;
        const int scans = 300;
        for (int k = 0; k < scans; ++k) {
          std::vector<int> hits;
          const std::vector<Wall> walls = c.make(random, k);
          const LaserScan scan = maker.scan(walls, random, &hits);
          total.add(
              test::score(extractor.extract(scan).segments, maker.truth(walls, hits), hits, sigma));
          add_told(maker, scan, walls, hits, extractor, observed);
        }
        const double half = 1.96 * 2 / std::sqrt(static_cast<double>(total.nees_one_wall.size()));
        const double nees = mean(total.nees_one_wall);
        std::printf(
            "%-24s %5d %6.0f  %7.4f %7.3f %7.2f  %8.2f %7.3f° %7.3f°  %.2f +-%.2f%s %8.2f\n",
            c.name, beams, 100 * sigma, total.recall(), double(total.false_lines) / scans,
            double(total.detected) / scans, 1e3 * median(total.rho_errors),
            median(total.angle_errors) * 180 / M_PI, median(observed) * 180 / M_PI, nees, half,
            std::abs(nees - 2) <= half ? " " : "!", mean(total.nees));
      }
    }
  }
}

struct Scanner {
  const char* name;
  int beams;
  double fov_deg, sigma, angle_sigma, sigma_per_m, range_max;
  bool descending;
};

// Scanners of other makes, in rooms with corners up to two thirds of what they reach.
void scanners() {
  const Scanner kScanners[] = {
      {"181 beams, 180 degrees, 5 mm", 181, 180, 0.005, 0.0005, 0, 12, false},
      {"181 beams, 180 degrees, 3 cm", 181, 180, 0.03, 0.0005, 0, 12, false},
      {"361 beams, all round, 1 cm", 361, 360 * 360.0 / 361, 0.01, 0.0005, 0, 12, false},
      {"720 beams, all round, descending", 720, 360 * 719.0 / 720, 0.01, 0.0005, 0, 12, true},
      {"682 beams, 240 degrees, 4 m, 1 cm", 682, 240, 0.01, 0.001, 0, 4, false},
      {"541 beams, 270 degrees, 30 m, 1 cm", 541, 270, 0.01, 0.0005, 0, 30, false},
      {"541, 30 m, 1 cm and 2 mm a metre", 541, 270, 0.01, 0.0005, 0.002, 30, false},
      {"1081, 30 m, 5 mm and 1 mm a metre", 1081, 270, 0.005, 0.0002, 0.001, 30, false},
      {"360 all round, 1 cm and 1 % of range", 360, 359, 0.01, 0.002, 0.01, 12, false},
  };
  std::printf("\n%-38s %7s %7s %7s  %8s %8s  %12s\n", "scanner, polygons of 5 to 10 corners",
              "recall", "false", "lines", "rho mm", "angle", "NEES (2)");
  for (const Scanner& s : kScanners) {
    ScanMaker maker;
    maker.beams = s.beams;
    maker.fov = s.fov_deg * M_PI / 180;
    maker.noise = {s.sigma, s.angle_sigma, 0.0};
    maker.range_max = s.range_max;
    maker.descending = s.descending;
    maker.sigma_per_m = s.sigma_per_m;
    std::mt19937 random(2);
    SegmentExtractor extractor;
    LineScore total;
    const int scans = 300;
    for (int k = 0; k < scans; ++k) {
      std::vector<int> hits;
      const std::vector<Wall> walls =
          test::random_polygon(random, 5 + k % 6, s.range_max / 6, s.range_max * 2 / 3);
      const LaserScan scan = maker.scan(walls, random, &hits);
      const double sigma = s.sigma + s.sigma_per_m * s.range_max / 2;
      total.add(
          test::score(extractor.extract(scan).segments, maker.truth(walls, hits), hits, sigma));
    }
    std::printf("%-38s %7.4f %7.3f %7.2f  %8.2f %7.3f°  %.2f\n", s.name, total.recall(),
                double(total.false_lines) / scans, double(total.detected) / scans,
                1e3 * median(total.rho_errors), median(total.angle_errors) * 180 / M_PI,
                mean(total.nees_one_wall));
  }
}

// A robot that turns on the spot, 2 rad/s, in a room of 8 x 6 m with four boxes; a scan is what the
// beams saw one after the other. A switch: a wall under none of its ids of the scan
// before.
void turning() {
  constexpr double kRate = 2, kScansPerSecond = 5;
  constexpr int kScans = 200;
  std::printf("\n%-38s %7s %7s %7s %9s %9s\n", "turning at 2 rad/s, 5 scans a second", "recall",
              "false", "lines", "switches", "followed");
  for (const auto& [sweep, straighten] : {std::pair{0.0, false},
                                          {0.01875, false},
                                          {0.0375, false},
                                          {0.075, false},
                                          {0.15, false},
                                          {0.01875, true},
                                          {0.0375, true},
                                          {0.075, true},
                                          {0.15, true}}) {
    ScanMaker maker;
    maker.beams = 541;
    maker.noise = {0.01, 0.0005, 0.0};
    maker.turn = kRate * sweep;
    std::mt19937 random(5), furniture(3);
    const std::vector<Wall> still = furnished_room(furniture);
    SegmentFrontend frontend;
    LineScore total;
    std::map<int, std::set<std::int64_t>> before;
    int switches = 0, followed = 0;
    for (int k = 0; k < kScans; ++k) {
      const double yaw = k * kRate / kScansPerSecond;
      const Eigen::Rotation2Dd R(-yaw);
      std::vector<Wall> walls;
      for (const Wall& wall : still) walls.push_back({R * wall.a, R * wall.b});
      std::vector<int> hits;
      LaserScan scan = maker.scan(walls, random, &hits);
      scan.stamp = Timestamp::from_seconds(k / kScansPerSecond);
      if (straighten) {
        Vector6d velocity = Vector6d::Zero();
        velocity(5) = kRate;
        scan = straightened(scan, sweep / (maker.beams - 1), velocity);
        // The walls are those of the middle of the sweep.
        for (float& angle : scan.angles) angle -= static_cast<float>(0.5 * maker.turn);
      }
      const Observations out =
          frontend.process(scan, SE3::planar(0, 0, k == 0 ? 0 : kRate / kScansPerSecond));
      const std::vector<ScanSegment>& segments = frontend.last().segments;
      total.add(test::score(segments, maker.truth(walls, hits), hits, 0.01));
      std::map<int, std::set<std::int64_t>> now;
      for (const SegmentObservation& s : out.segments) {
        if (s.track >= 0) {
          now[test::majority_wall(s.segment, hits, walls.size())].insert(s.track);
        }
      }
      for (const auto& [wall, ids] : now) {
        const auto old = before.find(wall);
        if (old == before.end()) continue;
        ++followed;
        switches += std::none_of(ids.begin(), ids.end(),
                                 [&](std::int64_t id) { return old->second.count(id) > 0; });
      }
      before = std::move(now);
    }
    std::printf("sweep %.0f ms, %s%-*.1f %7.4f %7.3f %7.2f %9d %9d\n", 1e3 * sweep,
                straighten ? "straightened " : "turns ", straighten ? 12 : 19,
                maker.turn * 180 / M_PI, total.recall(), double(total.false_lines) / kScans,
                double(total.detected) / kScans, switches, followed);
  }
}

void speed() {
  for (const Case& c : kCases) {
    ScanMaker maker;
    std::mt19937 random(1);
    std::vector<LaserScan> scans;
    for (int k = 0; k < 50; ++k) scans.push_back(maker.scan(c.make(random, k), random));
    SegmentExtractor extractor;
    SegmentTracker tracker;
    std::vector<double> extraction(scans.size(), 1e9), tracking(scans.size(), 1e9);
    double lines = 0;
    for (int repeat = 0; repeat < 100; ++repeat) {
      for (std::size_t k = 0; k < scans.size(); ++k) {
        const double start = microseconds();
        const Segments out = extractor.extract(scans[k]);
        extraction[k] = std::min(extraction[k], microseconds() - start);
        lines += static_cast<double>(out.segments.size());
        std::vector<NoiseFloor> floors(out.segments.size());
        for (int seen = 0; seen < 3; ++seen) {
          const double begin = microseconds();
          const Timestamp stamp =
              Timestamp::from_seconds(repeat * 100 + 1.0 * double(k) + 0.1 * seen);
          tracker.update(out.segments, floors, stamp, SE3::planar(0.01, 0, 0.001),
                         1e-5 * Matrix6d::Identity());
          tracking[k] = std::min(tracking[k], microseconds() - begin);
        }
      }
    }
    std::printf(
        "%-24s 1081 beams, %.1f lines: extraction %.3f ms (worst scan %.3f), tracking %.3f ms\n",
        c.name, lines / 100 / 50, 1e-3 * median(extraction),
        1e-3 * *std::max_element(extraction.begin(), extraction.end()), 1e-3 * median(tracking));
  }
}

}  // namespace

int main() {
  accuracy();
  scanners();
  turning();
  std::printf("\nleast of 100 repetitions a scan, median over 50 scans, one thread\n");
  speed();
}
