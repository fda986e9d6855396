"""A THORMANG3 that plays Dr. Eureka: card, plan, tubes, two arms.

The rooms and what each may import are in `test/test_architecture.py`; only `dr_eureka.nodes` knows ROS.
"""
