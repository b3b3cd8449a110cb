//! Hair with time: the model, its state and the step. Nothing is here yet; hairs ride the skin in their root frames.
