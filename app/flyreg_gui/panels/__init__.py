"""The parts of the window around the views: steps, landmarks, start page, messages."""
