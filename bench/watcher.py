"""A client of the viewer in the browser: python watcher.py URL.

Looks at the first world with scans. For each line on the standard input, prints the number of bytes
received so far. Ends with the input.
"""

from __future__ import annotations

import asyncio
import sys

import aiohttp


async def main(url: str) -> None:
    """Counts what arrives, until the input ends."""
    received = 0
    async with aiohttp.ClientSession() as session, session.ws_connect(f"{url}ws") as socket:
        await socket.send_json({"type": "look", "worlds": [0], "scans": True})

        async def count() -> None:
            nonlocal received
            async for message in socket:
                received += len(message.data)

        counting = asyncio.create_task(count())
        while await asyncio.to_thread(sys.stdin.readline):
            print(received, flush=True)
        counting.cancel()


if __name__ == "__main__":
    asyncio.run(main(sys.argv[1]))
