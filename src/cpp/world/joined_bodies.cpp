#include "world/joined_bodies.h"

#include <box2d/b2_body.h>
#include <box2d/b2_joint.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "vec.h"
#include "world/bodies.h"

namespace flatland {

void place_with_joined(World& world, b2Body* body, const Triple& pose) {
  std::vector<b2Body*> joined{body};
  for (std::size_t i = 0; i < joined.size(); ++i) {
    for (b2JointEdge* edge = joined[i]->GetJointList(); edge != nullptr; edge = edge->next) {
      const bool is_new = std::find(joined.begin(), joined.end(), edge->other) == joined.end();
      if (is_new && edge->other->GetType() != b2_staticBody) joined.push_back(edge->other);
    }
  }
  const Triple before = pose_of(*body);
  const double turn = pose[2] - before[2];
  const Vec ahead{std::cos(turn), std::sin(turn)};
  for (b2Body* each : joined) {
    const Triple from = pose_of(*each);
    const Vec offset{from[0] - before[0], from[1] - before[1]};
    const Vec turned = offset.x * ahead + offset.y * left_of(ahead);
    set_pose(world, each, {pose[0] + turned.x, pose[1] + turned.y, from[2] + turn});
    set_velocity(each, {});
  }
}

}  // namespace flatland
