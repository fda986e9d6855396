"""Recordings read without a ROS master: which topics a bag has, its images and joint states, what the vision sees."""
