"""Command lines that run without a ROS master, one module a command."""
