// What rays can hit.
#pragma once

#include <cstddef>
#include <vector>

class b2Body;
class b2Fixture;

namespace flatland {

// The fixtures of a world, sorted for ray casting: circles and polygons one by one.
class RayScene {
 public:
  void add(b2Fixture* fixture);
  // Takes all fixtures of a body out.
  void remove_body(const b2Body* body);
  // The category or sensor flag of a fixture is another.
  void changed(const b2Fixture* fixture);
  void clear();

 private:
  std::vector<b2Fixture*> solids_;
};

}  // namespace flatland
