// Ids of states: given by the Graph in rising order and never used twice; -1 stands for none.
#pragma once

#include <cstdint>

namespace lamina {

enum class KeyframeId : std::int64_t { kNone = -1 };
enum class PlaneId : std::int64_t { kNone = -1 };
enum class SurfelId : std::int64_t { kNone = -1 };
enum class ExtrinsicsId : std::int64_t { kNone = -1 };
enum class CustomStateId : std::int64_t { kNone = -1 };

}  // namespace lamina
