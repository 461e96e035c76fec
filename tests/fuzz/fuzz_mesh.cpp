// PLY and OBJ meshes; the first byte chooses. Triangles name vertices that are there.
#include <lamina/models/error.hpp>
#include <lamina/sim/mesh_file.hpp>

#include "fuzz/fuzz_input.hpp"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using lamina::fuzz::demand;
  if (size == 0) return 0;
  const std::string bytes(lamina::fuzz::text_of(data + 1, size - 1));
  try {
    const lamina::sim::Mesh mesh = data[0] % 2 == 0 ? lamina::sim::parse_ply(bytes, "m.ply")
                                                    : lamina::sim::parse_obj(bytes, "m.obj");
    const int count = static_cast<int>(mesh.vertices_map.size());
    for (const auto& triangle : mesh.triangles) {
      demand(triangle.minCoeff() >= 0 && triangle.maxCoeff() < count);
    }
  } catch (const lamina::Error&) {
  }
  return 0;
}
