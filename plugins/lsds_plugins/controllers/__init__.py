"""Controllers: what aperture stops it?"""
