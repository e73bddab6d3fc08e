"""Reading: what files of pictures, heights and measured surfaces hold. Each is hostile until it is read."""
