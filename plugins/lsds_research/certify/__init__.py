"""Study `certify`: how likely a rig is to drop an object, how sure that is, and in which ranges it is most likely."""
