"""Ten million samples, streamed: drawn block by block, the latest kept at hand for training."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import torch

from dr_eureka.kinematics.chain import Chain
from dr_eureka.kinematics.samples import Samples, SampleSettings, draw_samples

JOINTS, DELTA, WANTED = slice(0, 7), slice(7, 13), slice(13, 32)  # columns of a row


def as_rows(samples: Samples) -> np.ndarray:
    """Return samples as float32 rows (n, 32): joints, delta, joint change, rotation by rows and position of the target."""
    rotation = samples.target[:, :3, :3].reshape(-1, 9)
    return np.hstack([samples.joints, samples.delta, samples.change, rotation, samples.target[:, :3, 3]]).astype(np.float32)


class SampleStream:
    """The latest blocks of a stream of samples. Block r comes from a generator seeded with (seed, r) alone."""

    def __init__(self, chain: Chain, settings: SampleSettings, seed: int, block: int, blocks_kept: int) -> None:
        """Take how many samples a block holds and how many blocks are kept."""
        self._chain, self._settings, self._seed, self._block = chain, settings, seed, block
        self._kept = blocks_kept
        self._rows = torch.empty((blocks_kept * block, 32))
        self._drawn = 0

    def go_to(self, round_number: int) -> None:
        """Hold the blocks up to that of a round; those that a run broken off had at hand are drawn again."""
        for number in range(max(self._drawn, round_number + 1 - self._kept), round_number + 1):
            samples = draw_samples(self._chain, self._block, np.random.default_rng([self._seed, number]), self._settings)
            place = number % self._kept * self._block
            self._rows[place : place + self._block] = torch.from_numpy(as_rows(samples))
        self._drawn = round_number + 1

    def batches(self, round_number: int, batch: int, count: int) -> Iterator[torch.Tensor]:
        """Yield `count` batches (batch, 32) drawn from what is kept: the same whenever the round is the same."""
        self.go_to(round_number)
        held = min(round_number + 1, self._kept) * self._block
        order = torch.Generator().manual_seed((self._seed << 20) + round_number)
        for _ in range(count):
            yield self._rows[torch.randint(held, (batch,), generator=order)]
