"""`python3 -m unittest training.test_study_tables`: figures as they are printed, and differences the right way round."""

import unittest

from benches.numbers import number, share

from . import study_tables

class Tables(unittest.TestCase):
    def test_figures_are_printed_short(self):
        self.assertEqual(number({"value": 1.26, "interval": [1.0, 1.44]}, 1), "1.3 [1.0, 1.4]")
        self.assertEqual((number(None, 1), number(2.0, 0)), ("-", "2"))
        self.assertEqual(share({"hits": 28, "of": 30, "interval": [0.787, 0.982]}), "28/30 (79-98 %)")

    def test_a_difference_is_the_row_less_what_it_is_compared_with(self):
        base = {"method": "latent diffusion", "condition": "plain", "rotation": True, "flip": True, "geometry": "full", "shift": "exact",
                "fit": [], "test": "test-set", "test_grasps": 4}
        group = lambda value: {"group": "seen_tools", "psnr_db": {"value": value, "interval": [value - 0.5, value + 0.5]}}
        row = lambda value, **other: {"settings": base | other, "groups": [group(value)]}
        rows = [row(20.0 + n / 1000, samples=n) for n in (1000, 2000, 4000)] + [row(21.0, samples=2000, method="VQ-VAE")]
        less = lambda one, value, **to: {"from": one["settings"], "to": to, "groups": [group(value)]}
        # The first is the wrong way round, the second skips a budget.
        differences = [less(rows[3], 1.0, method="latent diffusion"), less(rows[0], 3.0, samples=4000), less(rows[0], 1.0, samples=2000)]
        text = study_tables.tables({"rows": rows, "differences": differences})
        self.assertIn("| VQ-VAE, 2,000 samples | latent diffusion, 2,000 samples | **-1.0 [-1.5, -0.5]** | - ", text)
        self.assertIn("| latent diffusion, 2,000 samples | latent diffusion, 1,000 samples | **1.0 [0.5, 1.5]** | - ", text)
        self.assertNotIn("latent diffusion, 4,000 samples | latent diffusion, 1,000 samples", text)
        self.assertNotIn("### Ablations", text, "a table of the reference alone says nothing")

if __name__ == "__main__":
    unittest.main()
