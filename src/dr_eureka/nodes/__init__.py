"""The ROS side: parameters read once, messages converted, cores called."""
