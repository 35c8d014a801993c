"""A node that subscribes to topics and takes what comes: python listener.py topic:package/Type ...

Says `ready` when it has asked for all of them, then the time of the monotonic clock [s] at which
the first message of each topic came, and the number of messages when it ends.
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


def take(_message: object, topic: str) -> None:
    """Counts a message."""
    if not counts[topic]:
        print(f"first {topic} {time.monotonic()}", flush=True)
    counts[topic] += 1


def main() -> None:
    """Listens until it is interrupted."""
    stopped = threading.Event()
    rospy.init_node("bench_listener", anonymous=True, disable_signals=True, disable_rostime=True)
    signal.signal(signal.SIGINT, lambda *_: stopped.set())
    for argument in sys.argv[1:]:
        topic, message_type = argument.split(":")
        rospy.Subscriber(topic, roslib.message.get_message_class(message_type), take, topic)
    print("ready", flush=True)
    stopped.wait()
    print(f"counts {dict(counts)}", flush=True)
    rospy.signal_shutdown("done")


if __name__ == "__main__":
    main()
