#include <pcl/point_types.h>
#include <lamina/backend/graph.hpp>
using namespace std;
