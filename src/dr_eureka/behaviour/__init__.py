"""What to do next: the course of a game from the first image to the verdict, without ROS."""
