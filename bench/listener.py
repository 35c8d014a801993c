"""A node that subscribes to topics: python listener.py topic:package/Type...

Prints `ready` after all subscriptions, then the arrival time of the first message of each topic on
the monotonic clock [s], and at exit the number of messages of each topic.
"""

from __future__ import annotations

import signal
import sys
import threading
import time
from collections import Counter

import roslib.message
import rospy

counts: Counter[str] = Counter()


def count_message(_message: object, topic: str) -> None:
    """Counts a message of a topic, and prints the arrival time of the first one."""
    if not counts[topic]:
        print(f"first {topic} {time.monotonic()}", flush=True)
    counts[topic] += 1


def main() -> None:
    """Counts messages until SIGINT."""
    stopped = threading.Event()
    rospy.init_node("bench_listener", anonymous=True, disable_signals=True, disable_rostime=True)
    signal.signal(signal.SIGINT, lambda *_: stopped.set())
    for argument in sys.argv[1:]:
        topic, message_type = argument.split(":")
        rospy.Subscriber(
            topic, roslib.message.get_message_class(message_type), count_message, topic
        )
    print("ready", flush=True)
    stopped.wait()
    print(f"counts {dict(counts)}", flush=True)
    rospy.signal_shutdown("done")


if __name__ == "__main__":
    main()
