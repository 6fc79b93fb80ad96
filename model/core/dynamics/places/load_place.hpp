// The place of a force or moment on a link.
#pragma once

namespace flexura {

// Where a load acts, and in whose axes its force is given.
struct LoadPlace {
  int link = 0;
  double at = 0.0;        // abscissa on the link's material [m]
  bool follower = false;  // along and across the line there, in place of the base's x and y
};

}  // namespace flexura
