// Triangle meshes from PLY and OBJ files.
#pragma once

#include <filesystem>
#include <string>

#include <lamina/sim/scene.hpp>

namespace lamina::sim {

/// Reads vertices and faces (polygons become fans); everything else in the file is skipped. PLY:
/// ascii and binary, little and big endian. OBJ: v and f, with negative indices. Throws
/// lamina::Error naming the file and the line (or byte) of what cannot be read.
Mesh read_mesh(const std::filesystem::path& file);
Mesh parse_ply(const std::string& bytes, const std::string& name);
Mesh parse_obj(const std::string& bytes, const std::string& name);

/// The faces of a planar scene as triangles, in single precision. Cylinders are left out.
Mesh triangulate(const Scene& scene);

}  // namespace lamina::sim
