// The window against batch solutions.
#include <lamina/backend/sliding_window.hpp>

#include <gtest/gtest.h>
