"""`python3 -m unittest benches.numbers.test_pages`: quoted tables are put in, and figures that were not measured are found."""

import unittest
from unittest import mock

from . import pages, study_tables
from .steps import rounded
from .tables import TABLES, number, share

LOOP = {"after": "try", "per_trial": {"hits": 29, "of": 30, "interval": [0.83, 0.99]}, "regrasps": 4, "refusals": 0}
METHOD = {"method": "Measured (upper bound)", "mean_deg": 0.25, "success": {"hits": 28, "of": 30, "interval": [0.787, 0.982]},
          "sweep": {"0.5": {"hits": 7}}, "with_verdict": [LOOP]}
STEPS = {"trials": {**{sensors: {"cup": [METHOD]} for sensors in ("nominal", "drawn", "other_gelslims")}, "published": []}}
PAGE = "# Trials\n\n<!-- numbers: trials -->\nold\n<!-- /numbers -->\n\nOf 30, 28/30 stand, by 0.2°; not 27/30.\n"


class Pages(unittest.TestCase):
    def test_a_quoted_table_is_what_was_measured(self):
        text = pages.quoted(PAGE, STEPS)
        self.assertIn("| cup | measured imprint (upper bound) | 0.2 | 28/30 (79-98 %) | 7 | 29/30 (83-99 %), 4 regrasps | - |", text)
        self.assertNotIn("old", text)
        self.assertEqual(pages.quoted(text, STEPS), text)
        self.assertEqual(pages.quoted(PAGE, {}), PAGE, "what was not measured stays")

    def test_a_figure_that_nobody_measured_is_found(self):
        generated = mock.Mock(exists=lambda: True, read_text=lambda: "28/30 and 0.2")
        with mock.patch.object(pages, "PAGE", generated):
            self.assertEqual(pages.strangers("README.md", PAGE), ["27/30"])
            self.assertEqual(pages.strangers("README.md", "`9.9 dB` ```\n8 %\n``` 5° and 0.2 dB"), [])

    def test_figures_are_kept_and_printed_short(self):
        self.assertEqual(rounded({"a": 1 / 3, "b": [None, 2], "c": None}), {"a": 0.33333, "b": [None, 2]})
        self.assertEqual(number({"value": 1.26, "interval": [1.0, 1.44]}, 1), "1.3 [1.0, 1.4]")
        self.assertEqual((number(None, 1), number(2.0, 0)), ("-", "2"))
        self.assertEqual(share(METHOD["success"]), "28/30 (79-98 %)")
        self.assertTrue(all(callable(of) for _, of in TABLES.values()))

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
