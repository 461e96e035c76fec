// Maps a recording with positions from elsewhere (GNSS, a total station): a line each of FIXES,
// "stamp x y z sigma", in the map's axes and metres. As `lamina map`, but for the factors.
#include <ceres/autodiff_cost_function.h>
#include <ceres/loss_function.h>

#include <cstdio>
#include <fstream>

#include <lamina/lamina.hpp>

// (R offset + t - fix) / sigma, `offset` the receiver's place in the keyframe's body.
struct Fix {
  Eigen::Vector3d position_map, offset_body;
  double sigma;
  template <class T>
  bool operator()(const T* pose, T* r) const {
    const Eigen::Quaternion<T> q(pose[6], pose[3], pose[4], pose[5]);
    Eigen::Map<Eigen::Matrix<T, 3, 1>> residual(r);
    residual = q.normalized() * offset_body.cast<T>() - position_map.cast<T>();
    for (int i = 0; i < 3; ++i) residual(i) = (residual(i) + pose[i]) / sigma;
    return true;
  }
};

// From its archived numbers, too: `data` is position, offset, sigma.
lamina::CustomFactor gps(const std::vector<double>& data) {
  const Fix fix{{data[0], data[1], data[2]}, {data[3], data[4], data[5]}, data[6]};
  lamina::CustomFactor factor;
  factor.kind = "gps";
  factor.cost = std::make_shared<ceres::AutoDiffCostFunction<Fix, 3, 7>>(new Fix(fix));
  factor.may_be_wrong = true;
  factor.data = data;
  return factor;
}

int main(int argc, char** argv) try {
  if (argc != 4) return std::fputs("usage: gps_factor INPUT FIXES OUTPUT\n", stderr), 2;
  lamina::register_factor("gps", gps);
  lamina::MapRequest request;
  request.input = argv[1];
  request.output = argv[3];
  auto [recording, options] = lamina::requested(request);
  options.add_factors = [&](lamina::Mapper& mapper) {
    std::ifstream fixes(argv[2]);
    for (double s, x, y, z, sigma; fixes >> s >> x >> y >> z >> sigma;) {
      const auto at = mapper.keyframe_at(lamina::Timestamp::from_seconds(s), 0.05);
      if (!at) continue;
      const Eigen::Vector3d offset = at->T_keyframe_body.translation();
      lamina::CustomFactor factor = gps({x, y, z, offset.x(), offset.y(), offset.z(), sigma});
      factor.states = {at->keyframe};
      mapper.add_factor(factor);
    }
  };
  const lamina::MapResult result = lamina::map(recording, options);
  std::fputs(lamina::write_results(argv[3], result).summary.c_str(), stdout);
} catch (const std::exception& error) {
  return std::fprintf(stderr, "%s\n", error.what()), 2;
}
