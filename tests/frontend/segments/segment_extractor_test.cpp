// Segments of simulated scans: recall, errors, covariance, odd scans.
#include <gtest/gtest.h>

#include <lamina/frontend/segments/line_fit.hpp>
#include <lamina/frontend/segments/segment_extractor.hpp>
#include <numeric>

#include "frontend/segments/scan_maker.hpp"

namespace lamina {
namespace {
using test::LineScore;
using test::ScanMaker;
using test::Wall;

LineScore run_polygons(int beams, double sigma, int count) {
  ScanMaker maker;
  maker.beams = beams;
  maker.noise.range_sigma = sigma;
  std::mt19937 random(7);
  SegmentExtractor extractor;
  LineScore total;
  for (int k = 0; k < count; ++k) {
    const auto walls = test::random_polygon(random, 4 + k % 5, 2, 8);
    std::vector<int> hits;
    const LaserScan scan = maker.scan(walls, random, &hits);
    total.add(test::score(extractor.extract(scan).segments, maker.truth(walls, hits), hits, sigma));
  }
  return total;
}

TEST(SegmentExtractor, FindsTheWallsOfRandomPolygons) {
  for (const int beams : {361, 541, 1081}) {
    const LineScore score = run_polygons(beams, 0.01, 100);
    EXPECT_GT(score.expected, 300);
    EXPECT_GE(score.recall(), 0.99) << beams;
    EXPECT_LE(score.false_lines, 5) << beams << " beams, of " << score.detected;
  }
}

TEST(SegmentExtractor, FindsTheWallsInStrongNoise) {
  for (const int beams : {361, 541, 1081}) {
    const LineScore score = run_polygons(beams, 0.03, 100);
    EXPECT_GE(score.recall(), 0.92) << beams;
    EXPECT_LE(score.false_lines, 5) << beams << " beams, of " << score.detected;
  }
}

TEST(SegmentExtractor, FindsTheFourWallsOfARoomAcrossTheSeam) {
  ScanMaker maker;
  maker.beams = 720;
  maker.fov = 2 * M_PI * 719 / 720;
  std::mt19937 random(3);
  SegmentExtractor extractor;
  for (int k = 0; k < 50; ++k) {
    const auto walls = test::room(6, 4, 2.0, 1.5, 0.13 * k);
    const Segments out = extractor.extract(maker.scan(walls, random));
    EXPECT_EQ(out.segments.size(), 4u) << k;
  }
}

// A door in a wall 2 m away, behind which all is out of range.
TEST(SegmentExtractor, ShortSightedScannersSeeDoors) {
  const std::vector<Wall> walls{{{2, -3}, {2, -0.45}}, {{2, 0.45}, {2, 3}}};
  std::mt19937 random(3);
  SegmentExtractor extractor;
  ScanMaker maker;
  maker.beams = 361;
  maker.range_max = 6;
  LaserScan scan = maker.scan(walls, random);
  EXPECT_EQ(extractor.extract(scan).segments.size(), 2u);
  // A few beams lost on a whole wall are no door, nor what never comes back to one that sees far.
  maker.range_max = 30;
  EXPECT_EQ(extractor.extract(maker.scan(walls, random)).segments.size(), 1u);
  maker.range_max = 6;
  scan = maker.scan({{{2, -3}, {2, 3}}}, random);
  for (const std::size_t i : {179, 180, 181}) scan.ranges[i] = 0;
  EXPECT_EQ(extractor.extract(scan).segments.size(), 1u);
}

TEST(SegmentExtractor, CovarianceIsWhatMonteCarloSays) {
  // One oblique wall, range and angle noise as the model says.
  const std::vector<Wall> walls = {{{1.5, -1.0}, {4.0, 3.0}}};
  ScanMaker maker;
  maker.noise = {0.01, 0.0005, 0.0};
  std::mt19937 random(11);
  SegmentExtractor extractor;
  double nees = 0;
  const int runs = 1000;
  for (int k = 0; k < runs; ++k) {
    std::vector<int> hits;
    const LaserScan scan = maker.scan(walls, random, &hits);
    const Segments out = extractor.extract(scan);
    ASSERT_EQ(out.segments.size(), 1u);
    const LineScore score = test::score(out.segments, maker.truth(walls, hits), hits, 0.01);
    ASSERT_EQ(score.nees.size(), 1u);
    nees += score.nees[0] / runs;
  }
  // Mean of `runs` chi-squared variables of two degrees: 2 +- 1.96 * 2 / sqrt(runs).
  EXPECT_NEAR(nees, 2.0, 1.96 * 2 / std::sqrt(runs));
}

TEST(SegmentExtractor, CovarianceKnowsOfCornersThatAreHardToPlace) {
  // Many corners, flat ones among them, in strong noise: which beams belong to which wall is
  // unsure.
  ScanMaker maker;
  maker.beams = 541;
  maker.noise = {0.03, 0.0005, 0.0};
  std::mt19937 random(21);
  SegmentExtractor extractor;
  LineScore total;
  for (int k = 0; k < 200; ++k) {
    const auto walls = test::random_polygon(random, 9 + k % 6, 2, 8);
    std::vector<int> hits;
    const LaserScan scan = maker.scan(walls, random, &hits);
    total.add(test::score(extractor.extract(scan).segments, maker.truth(walls, hits), hits, 0.03));
  }
  const auto mean = [](const std::vector<double>& v) {
    return std::accumulate(v.begin(), v.end(), 0.0) / double(v.size());
  };
  const double bound = 1.96 * 2 / std::sqrt(double(total.nees_one_wall.size()));
  EXPECT_GT(total.nees_one_wall.size(), 1500u);
  EXPECT_NEAR(mean(total.nees_one_wall), 2.0, bound);
}

// How the moments' cost grows as the line turns by h either way, over h squared.
double curvature_of(const ScanSegment& s, double h) {
  const auto cost = [&](double dtheta) {
    const Eigen::Vector3d n(std::cos(s.theta + dtheta), std::sin(s.theta + dtheta), 0);
    return s.moments.cost(Plane(n, s.rho));
  };
  const double rise = cost(h) + cost(-h) - 2 * cost(0);
  EXPECT_NEAR(cost(h), cost(-h), 0.02 * rise);
  return rise / (h * h);
}

// The side of a pillar at a wall, met by its front: were the returns near the corners shared out by
// their own noise, its heading would be off by 6 mrad in every scan, the same way.
TEST(SegmentExtractor, CornersTurnNoLineTheSameWayInEveryScan) {
  ScanMaker maker;
  maker.beams = 541;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit;
  SegmentExtractor extractor;
  double weight = 0, error = 0;
  int found = 0;
  for (int k = 0; k < 600; ++k) {
    const double yaw = unit(random) - 0.5;
    const Eigen::Vector2d scanner(-1 - 2 * unit(random), 1.1);
    const auto seen = [&](double x, double y) {
      return Eigen::Vector2d(Eigen::Rotation2Dd(-yaw) * (Eigen::Vector2d(x, y) - scanner));
    };
    const std::vector<Wall> walls{
        {seen(-20, 0), seen(0, 0)}, {seen(0, 0), seen(0, 0.25)}, {seen(0, 0.25), seen(0.5, 0.25)}};
    std::vector<int> hits;
    const LaserScan scan = maker.scan(walls, random, &hits);
    for (const ScanSegment& segment : extractor.extract(scan).segments) {
      if (test::majority_wall(segment, hits, walls.size()) != 1) continue;
      const double information = 1 / segment.covariance(1, 1);
      error += information * std::remainder(segment.theta + yaw, 2 * M_PI);
      weight += information;
      ++found;
    }
  }
  EXPECT_GT(found, 500);
  EXPECT_NEAR(error / weight, 0, 2.5e-3);  // of 35 mrad a scan: 1.4 mrad is chance's
}

TEST(SegmentExtractor, MomentsHaveTheirLeastCostAtTheLine) {
  ScanMaker maker;
  std::mt19937 random(5);
  const LaserScan scan = maker.scan({{{1.0, 0.2}, {6.0, 3.0}}}, random);
  // The information in the moments is that of the fit's covariance,
  ScanPoints points;
  points.load(scan, {});
  std::vector<int> all(static_cast<std::size_t>(points.size())), rejected;
  std::iota(all.begin(), all.end(), 0);
  const auto fit = fit_line(points, all, points.sums(0, points.size()),
                            SegmentOptions().outlier_sigma, rejected);
  ASSERT_TRUE(fit);
  const double information = fit->covariance.inverse()(1, 1);
  EXPECT_NEAR(curvature_of(*fit, 0.1 / std::sqrt(information)), 2 * information,
              0.05 * information);
  EXPECT_EQ(fit->moments.count(), fit->count);
  // to which the extractor adds the doubt of corners.
  SegmentExtractor extractor;
  const Segments out = extractor.extract(scan);
  ASSERT_EQ(out.segments.size(), 1u);
  const ScanSegment& s = out.segments[0];
  const double observed = s.covariance.inverse()(1, 1);
  const double curvature = curvature_of(s, 0.1 / std::sqrt(observed));
  EXPECT_GT(curvature, 0.975 * 2 * observed);
  EXPECT_LT(curvature, 1.25 * 2 * observed);
  EXPECT_EQ(s.moments.count(), s.count);
}

TEST(SegmentExtractor, CurvedSurfacesAreNotLines) {
  ScanMaker maker;
  std::mt19937 random(9);
  SegmentExtractor extractor;
  int segments = 0;
  for (const double radius : {0.2, 0.5, 1.0, 2.0}) {
    std::vector<Wall> walls;
    for (int i = 0; i < 720; ++i) {
      const double a = i * M_PI / 360, b = (i + 1) * M_PI / 360;
      const Eigen::Vector2d centre(1.5 + radius, 0.3);
      walls.push_back({centre + radius * Eigen::Vector2d(std::cos(a), std::sin(a)),
                       centre + radius * Eigen::Vector2d(std::cos(b), std::sin(b))});
    }
    for (int k = 0; k < 10; ++k) {
      segments += static_cast<int>(extractor.extract(maker.scan(walls, random)).segments.size());
    }
  }
  EXPECT_LE(segments, 2);
}

// A wall round the origin, seen from inside or outside.
std::vector<Wall> round_wall(const Eigen::Vector2d& centre, double radius) {
  std::vector<Wall> walls;
  for (int i = 0; i < 720; ++i) {
    const double a = i * M_PI / 360, b = (i + 1) * M_PI / 360;
    walls.push_back({centre + radius * Eigen::Vector2d(std::cos(a), std::sin(a)),
                     centre + radius * Eigen::Vector2d(std::cos(b), std::sin(b))});
  }
  return walls;
}

// Chords of a round corridor slide along with the robot; taken for walls they turn the map.
TEST(SegmentExtractor, WallsOfARoundCorridorAreNotLines) {
  ScanMaker maker;
  maker.beams = 181;
  maker.fov = M_PI;
  maker.range_max = 8;
  maker.noise.range_sigma = 0.03;
  std::vector<Wall> walls = round_wall({0, 10}, 8.8);
  for (const Wall& wall : round_wall({0, 10}, 11.2)) walls.push_back(wall);
  std::mt19937 random(4);
  SegmentExtractor extractor;
  int segments = 0;
  constexpr int kScans = 50;
  for (int k = 0; k < kScans; ++k) {
    segments += static_cast<int>(extractor.extract(maker.scan(walls, random)).segments.size());
  }
  EXPECT_LE(segments, kScans / 5);
}

// A long wall is a wall beside a round one, too.
TEST(SegmentExtractor, AStraightWallBesideARoundOneIsFound) {
  ScanMaker maker;
  maker.beams = 361;
  maker.fov = M_PI;
  maker.noise.range_sigma = 0.02;
  std::vector<Wall> walls = round_wall({0, -4}, 3);
  walls.push_back({{-6, 1.5}, {6, 1.5}});
  std::mt19937 random(4);
  SegmentExtractor extractor;
  int found = 0;
  constexpr int kScans = 50;
  for (int k = 0; k < kScans; ++k) {
    for (const ScanSegment& s : extractor.extract(maker.scan(walls, random)).segments) {
      found += s.length() > 3 && std::abs(s.rho - 1.5) < 0.05 ? 1 : 0;
    }
  }
  EXPECT_GE(found, kScans - 1);
}

TEST(SegmentExtractor, OddScansDoNoHarm) {
  SegmentExtractor extractor;
  LaserScan scan;
  EXPECT_TRUE(extractor.extract(scan).segments.empty());
  scan.angle_increment = 0.01;
  scan.ranges = {2.0F};
  EXPECT_EQ(extractor.extract(scan).loose_beams.size(), 1u);
  scan.ranges.assign(500, std::numeric_limits<float>::quiet_NaN());
  EXPECT_EQ(extractor.extract(scan).missing, 500);
  scan.ranges.assign(500, std::numeric_limits<float>::infinity());
  EXPECT_EQ(extractor.extract(scan).missing, 500);
  scan.ranges.assign(500, 0.0F);
  EXPECT_EQ(extractor.extract(scan).missing, 500);
  scan.angle_increment = 0;
  scan.ranges.assign(500, 1.0F);
  EXPECT_TRUE(extractor.extract(scan).segments.empty());
}

TEST(SegmentExtractor, DescendingAnglesGiveTheSameLines) {
  ScanMaker up, down;
  up.noise.range_sigma = down.noise.range_sigma = 1e-4;
  down.descending = true;
  std::mt19937 random(1);
  SegmentExtractor extractor;
  const auto walls = test::room(6, 4, 2, 1.5, 0.3);
  const Segments a = extractor.extract(up.scan(walls, random));
  const Segments b = extractor.extract(down.scan(walls, random));
  ASSERT_EQ(a.segments.size(), b.segments.size());
  for (std::size_t i = 0; i < a.segments.size(); ++i) {
    const ScanSegment& s = b.segments[b.segments.size() - 1 - i];
    EXPECT_NEAR(a.segments[i].rho, s.rho, 1e-3);
    EXPECT_NEAR(a.segments[i].theta, s.theta, 1e-3);
    EXPECT_LT((a.segments[i].start - s.end).norm(), 0.05);
  }
}

TEST(SegmentExtractor, EveryReturnIsInASegmentOrLooseOrMissing) {
  ScanMaker maker;
  std::mt19937 random(21);
  SegmentExtractor extractor;
  LaserScan scan = maker.scan(test::random_polygon(random, 6, 2, 8), random);
  for (std::size_t i = 0; i < scan.size(); i += 17) scan.ranges[i] = 0;
  const Segments out = extractor.extract(scan);
  int in_segments = 0;
  for (const ScanSegment& s : out.segments) in_segments += s.count;
  EXPECT_EQ(in_segments + static_cast<int>(out.loose_beams.size()) + out.missing, maker.beams);
}

TEST(SegmentOptions, ProblemsAreNamed) {
  SegmentOptions options;
  options.min_points = 1;
  ASSERT_EQ(options.problems().size(), 1u);
  EXPECT_EQ(options.problems()[0], "segments.min_points: expected at least 3");
  EXPECT_TRUE(SegmentOptions().problems().empty());
}

}  // namespace
}  // namespace lamina
