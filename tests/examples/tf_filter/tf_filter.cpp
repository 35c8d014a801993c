// Receives laser scans through the message filter of tf2, as amcl, gmapping and costmap_2d do, and
// counts those that it drops.
//
// Usage: tf_filter DURATION TOPIC TARGET_FRAME...
//
// The program waits for the transform from the first target frame to the last one, then counts the
// scans of DURATION seconds of simulated time, and prints one line: received, passed and dropped
// messages, and the largest time between the stamps of two scans [s].

#include <message_filters/subscriber.h>
#include <ros/ros.h>
#include <sensor_msgs/LaserScan.h>
#include <tf2_ros/buffer.h>
#include <tf2_ros/message_filter.h>
#include <tf2_ros/transform_listener.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

namespace {

constexpr int kQueueSize = 100;        // as in amcl
constexpr double kLastWait = 10.0;     // of wall time, for the transforms of the last scans [s]
constexpr double kSpinPeriod = 0.005;  // of wall time [s]

struct Count {
  int received = 0;
  int passed = 0;
  int dropped = 0;
  double largest_gap = 0;
  ros::Time first;
  ros::Time last;

  void Receive(const sensor_msgs::LaserScanConstPtr& scan) {
    const ros::Time stamp = scan->header.stamp;
    if (received == 0) {
      first = stamp;
    } else {
      largest_gap = std::max(largest_gap, (stamp - last).toSec());
    }
    last = stamp;
    ++received;
  }
};

void Spin() { ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(kSpinPeriod)); }

}  // namespace

int main(int argc, char** argv) {
  ros::init(argc, argv, "tf_filter", ros::init_options::AnonymousName);
  if (argc < 5) {
    std::fprintf(stderr, "usage: tf_filter DURATION TOPIC TARGET_FRAME TARGET_FRAME...\n");
    return 2;
  }
  const ros::Duration duration(std::atof(argv[1]));
  const std::string topic = argv[2];
  const std::vector<std::string> frames(argv + 3, argv + argc);

  ros::NodeHandle node;
  tf2_ros::Buffer buffer;
  // Without a thread: MessageFilter::add of tf2 misses a transform that a thread of the listener
  // adds while it runs, and then keeps the scan for ever.
  tf2_ros::TransformListener listener(buffer, node, false);
  while (ros::ok() && !buffer.canTransform(frames.front(), frames.back(), ros::Time())) Spin();

  Count count;
  message_filters::Subscriber<sensor_msgs::LaserScan> subscriber;
  tf2_ros::MessageFilter<sensor_msgs::LaserScan> filter(buffer, "", kQueueSize, node);
  filter.setTargetFrames(frames);
  filter.registerCallback(boost::function<void(const sensor_msgs::LaserScanConstPtr&)>(
      [&](const auto&) { ++count.passed; }));
  filter.registerFailureCallback([&](const auto&, auto) { ++count.dropped; });
  // Before the filter, so that a scan is counted as received first.
  subscriber.registerCallback(boost::function<void(const sensor_msgs::LaserScanConstPtr&)>(
      [&](const sensor_msgs::LaserScanConstPtr& scan) { count.Receive(scan); }));
  filter.connectInput(subscriber);
  subscriber.subscribe(node, topic, kQueueSize);

  while (ros::ok() && (count.received == 0 || count.last - count.first < duration)) Spin();
  subscriber.unsubscribe();
  const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(kLastWait);
  while (ros::ok() && count.passed + count.dropped < count.received && ros::WallTime::now() < end) {
    Spin();
  }
  std::printf("received %d passed %d dropped %d largest gap %.6f\n", count.received, count.passed,
              count.dropped, count.largest_gap);
  return 0;
}
