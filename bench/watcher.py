"""A client of the viewer in the browser: python watcher.py URL.

Looks at the first world with scans. For each line on the standard input, prints the number of bytes
received up to the last message with scans, and the time of its arrival [s]: most bytes are in these
messages, and between two of them is a whole number of periods. Ends with the input.
"""

from __future__ import annotations

import asyncio
import sys
import time

import aiohttp

SCANS = 5  # kind of the message


async def main(url: str) -> None:
    """Counts what arrives, until the input ends."""
    received, at_scan = 0, (0, time.perf_counter())
    async with aiohttp.ClientSession() as session, session.ws_connect(f"{url}ws") as socket:
        await socket.send_json(
            {"type": "look", "worlds": [0], "scans": True, "compact_scans": True}
        )

        async def count() -> None:
            nonlocal received, at_scan
            async for message in socket:
                received += len(message.data)
                if message.type is aiohttp.WSMsgType.BINARY and message.data[0] == SCANS:
                    at_scan = (received, time.perf_counter())

        counting = asyncio.create_task(count())
        while await asyncio.to_thread(sys.stdin.readline):
            print(*at_scan, flush=True)
        counting.cancel()


if __name__ == "__main__":
    asyncio.run(main(sys.argv[1]))
