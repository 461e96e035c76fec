// Defines what offender.hpp defines.
namespace lamina {
struct Offender {};
}  // namespace lamina
