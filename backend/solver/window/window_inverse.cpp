// Diagonal blocks of the inverse from the window's factor.
#include <lamina/backend/solver/window/window_system.hpp>

namespace lamina {

// H^-1 = G^T G with G = L^-1 = [Lp^-1 0; -Ll^-1 W Lp^-1  Ll^-1], so the block of a state is the
// gram matrix of its own columns of G. Nothing of the blocks between states is formed.
WindowSystem::Blocks WindowSystem::inverse_blocks() const {
  const int np = 6 * poses_, nl = 3 * planes_;
  Blocks blocks;
  blocks.poses.reserve(static_cast<std::size_t>(poses_));
  blocks.planes.reserve(static_cast<std::size_t>(planes_));
  // Planes: Ll^-1 in panels of columns, each from its own first row on.
  constexpr int kPanel = 36;
  Eigen::MatrixXd panel;
  for (int begin = 0; begin < nl; begin += kPanel) {
    const int width = std::min(kPanel, nl - begin), rest = nl - begin;
    panel.setIdentity(rest, width);
    C_factor_.bottomRightCorner(rest, rest).triangularView<Eigen::Lower>().solveInPlace(panel);
    for (int k = 0; k < width; k += 3) {
      const auto G = panel.middleCols<3>(k).bottomRows(rest - k);
      blocks.planes.emplace_back(G.transpose().lazyProduct(G));
    }
  }
  // Poses: [I; -Ll^-1 W] Lp^-1 from the last column back; above its own row a column is zero.
  Eigen::MatrixXd G = Eigen::MatrixXd::Identity(np + nl, np);
  if (np > 0 && nl > 0) {
    G.bottomRows(nl) = -W_factor_;
    C_factor_.triangularView<Eigen::Lower>().solveInPlace(G.bottomRows(nl));
  }
  for (int i = np - 1; i >= 0; --i) {
    const double* row = band_factor_.data() + static_cast<std::size_t>(i) * width_;
    auto column = G.col(i).tail(np + nl - i);
    column /= row[i];
    for (int j = 6 * first_[static_cast<std::size_t>(i / 6)]; j < i; ++j) {
      G.col(j).tail(np + nl - i) -= row[j] * column;
    }
  }
  for (int i = 0; i < np; i += 6) {
    const auto columns = G.middleCols<6>(i).bottomRows(np + nl - i);
    blocks.poses.emplace_back(columns.transpose().lazyProduct(columns));
  }
  return blocks;
}

}  // namespace lamina
