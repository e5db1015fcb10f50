//! Files: what PyTorch wrote, the lab's folders, image folders, masks, export, and everything that can be wrong.

mod pt;
