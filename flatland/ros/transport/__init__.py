"""Publishers, subscribers and services that never block the thread that steps the world."""
