"""A PyBullet world with robot, table, tubes, balls, card, camera and referee."""
