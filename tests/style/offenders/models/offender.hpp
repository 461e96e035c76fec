#include <pcl/point_types.h>
#include <lamina/backend/graph/graph.hpp>
using namespace std;
// A formula from [Nobody1999].
namespace lamina {
struct Offender {};
}  // namespace lamina
