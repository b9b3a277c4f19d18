"""Helpers that know nothing of learning: arguments, files, interrupts, display, progress."""
