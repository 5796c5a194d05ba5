"""Parts of scenes/make.py: shapes, images and a glTF writer that checks what it writes."""
