// Uses all services and messages of the reference simulator, in a room with walls at x = ±5 m.
//
//   a_client MODEL_FILE
//
// Prints a line for each result, and exits with code 1 if an expected result is missing.

#include <flatland_msgs/Collisions.h>
#include <flatland_msgs/DebugTopicList.h>
#include <flatland_msgs/DeleteModel.h>
#include <flatland_msgs/MoveModel.h>
#include <flatland_msgs/SpawnModel.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>

#include <algorithm>
#include <functional>
#include <iostream>
#include <string>

namespace {

constexpr double kTimeout = 60.0;  // s of wall time, for each result

flatland_msgs::Collisions collisions;
flatland_msgs::DebugTopicList debug_topics;
bool has_collided = false;

void on_debug_topics(const flatland_msgs::DebugTopicList& message) { debug_topics = message; }

// The contact has points until the body sleeps, half a second later, which no poll may miss.
void on_collisions(const flatland_msgs::Collisions& message) {
  collisions = message;
  for (const auto& collision : message.collisions) {
    has_collided |= collision.entity_A == "crate" && collision.body_A == "box" &&
                    collision.entity_B == "2d" && !collision.contact_positions.empty() &&
                    collision.contact_positions[0].x > 4.0;
  }
}

bool lists_crate() {
  const auto& topics = debug_topics.topics;
  return std::find(topics.begin(), topics.end(), "model/crate") != topics.end();
}

void expect(const std::string& result, const std::function<bool()>& condition) {
  const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(kTimeout);
  while (!condition()) {
    if (!ros::ok() || ros::WallTime::now() > end) {
      std::cout << "missing: " << result << std::endl;
      std::exit(1);
    }
    ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(0.05));
  }
  std::cout << result << std::endl;
}

template <typename Service>
bool call(ros::NodeHandle& node, const std::string& name, Service& service) {
  if (!ros::service::call(node.resolveName(name), service)) {
    std::cout << "the call of " << name << " failed" << std::endl;
    std::exit(1);
  }
  return service.response.success;
}

}  // namespace

int main(int argc, char** argv) {
  ros::init(argc, argv, "a_client");
  ros::NodeHandle node;
  ros::service::waitForService("spawn_model");
  const ros::Subscriber topics_subscriber =
      node.subscribe("flatland_server/debug/topics", 1, on_debug_topics);
  const ros::Subscriber collisions_subscriber =
      node.subscribe("crate/collisions", 0, on_collisions);  // all messages

  flatland_msgs::SpawnModel spawn;
  spawn.request.yaml_path = "/nowhere/crate.yaml";
  spawn.request.name = "crate";
  spawn.request.ns = "crate";
  expect("an absent model file is refused", [&] {
    return !call(node, "spawn_model", spawn) &&
           spawn.response.message.find("/nowhere/crate.yaml") != std::string::npos;
  });
  spawn.request.yaml_path = argv[1];
  expect("spawned", [&] { return call(node, "spawn_model", spawn); });
  expect("listed", lists_crate);
  expect("publishes",
         [] { return !collisions.header.frame_id.empty() && collisions.collisions.empty(); });

  flatland_msgs::MoveModel move;
  move.request.name = "crate";
  move.request.pose.x = 5.0;
  expect("moved to a wall", [&] { return call(node, "move_model", move); });
  expect("collides with the wall", [] { return has_collided; });
  move.request.pose.x = 0.0;
  expect("moved back", [&] { return call(node, "move_model", move); });
  expect("is free", [] { return collisions.collisions.empty(); });

  flatland_msgs::DeleteModel remove;
  remove.request.name = "crate";
  expect("deleted", [&] { return call(node, "delete_model", remove); });
  expect("no longer listed", [] { return !lists_crate(); });
  return 0;
}
